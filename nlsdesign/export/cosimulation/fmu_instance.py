"""One loaded instance of an FMU, with the same interface for FMI 2.0 and 3.0."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import numpy as np
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray

from ...errors import ConvergenceError, ExportError
from .fmu_description import FmuDescription, FmuVariable
from .isolation import Activity, Watch

Array = NDArray[np.float64]
_WARNING = 1
"""The highest status with which both versions of FMI go on."""


class FmuInstance:
    """An FMU that has been loaded and instantiated.

    Parameters
    ----------
    description
        Of the FMU.
    watch
        Told what is called, so that a crash can be explained.

    Raises
    ------
    ExportError
        If its library cannot be loaded or instantiated.
    """

    def __init__(self, description: FmuDescription, watch: Watch) -> None:
        self.name = description.instance
        self.description = description
        self.messages: list[str] = []
        self._watch = watch
        self._two = description.version == "2.0"
        self._running = False
        watch(self.name, Activity.LOADING)
        self._fmu = self._load()
        watch(self.name, Activity.INSTANTIATING)
        try:
            self._instantiate()
            self._step = self._step_function()
        except Exception as error:
            self._fmu.freeLibrary()
            raise ExportError(
                f"instance '{self.name}'", f"could not be made: {_why(self.messages, error)}"
            ) from error

    def _load(self) -> Any:
        here = os.getcwd()
        kind = fmpy.fmi2.FMU2Slave if self._two else fmpy.fmi3.FMU3Slave
        try:
            return kind(
                guid=self.description.token,
                modelIdentifier=self.description.identifier,
                unzipDirectory=str(self.description.folder),
                instanceName=self.name,
                libraryPath=str(self.description.library),
            )
        except Exception as error:
            raise ExportError(f"instance '{self.name}'", f"its library does not load: {error}") from error
        finally:
            os.chdir(here)  # fmpy does not restore it where loading fails

    def _instantiate(self) -> None:
        def log(status: int, message: bytes) -> None:
            if status > 0:
                self.messages.append(message.decode("utf-8", errors="replace"))

        if self._two:
            callbacks = fmpy.fmi2.fmi2CallbackFunctions()
            ctypes.memmove(
                ctypes.byref(callbacks),
                ctypes.byref(fmpy.fmi2.defaultCallbacks),
                ctypes.sizeof(callbacks),
            )
            callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(
                lambda _e, _n, status, _c, text: log(status, text)
            )
            self._fmu.instantiate(callbacks=callbacks)
        else:
            self._fmu.instantiate(logMessage=lambda _e, status, _c, text: log(status, text))

    @contextmanager
    def _explained(
        self, what: str, kind: type[ExportError] | type[ConvergenceError] = ExportError
    ) -> Iterator[None]:
        try:
            yield
        except FMICallException as error:
            raise kind(f"instance '{self.name}', {what}", _why(self.messages, error)) from error

    def begin(self, start: float, stop: float | None) -> None:
        """Enter the initialization mode.

        Parameters
        ----------
        start, stop
            Times in s; ``None`` without an end.
        """
        self._watch(self.name, Activity.INITIALIZING)
        with self._explained("initialization"):
            if self._two:
                self._fmu.setupExperiment(startTime=start, stopTime=stop)
                self._fmu.enterInitializationMode()
            else:
                self._fmu.enterInitializationMode(startTime=start, stopTime=stop)

    def run(self) -> None:
        """Leave the initialization mode."""
        self._watch(self.name, Activity.INITIALIZING)
        with self._explained("initialization"):
            self._fmu.exitInitializationMode()
        self._running = True

    def set(self, values: Mapping[str, float]) -> None:
        """Set variables.

        Parameters
        ----------
        values
            Numbers by name.

        Raises
        ------
        ExportError
            With the message of the FMU if it refuses.
        """
        for name, value in values.items():
            variable = self.description.variables[name]
            self._watch(self.name, Activity.SETTING)
            with self._explained(f"setting {name}"):
                if variable.kind == "real":
                    (self._fmu.setReal if self._two else self._fmu.setFloat64)([variable.reference], [value])
                else:
                    (self._fmu.setInteger if self._two else self._fmu.setInt32)(
                        [variable.reference], [int(value)]
                    )

    def setter(self, names: Sequence[str], values: Array) -> Callable[[], None]:
        """Return a function that sets real variables to what an array holds when it is called.

        Parameters
        ----------
        names
            Of real variables.
        values
            Shape (n,), contiguous; the function reads it.
        """
        variables = [self.description.variables[name] for name in names]
        call = self._access("fmi2SetReal" if self._two else "fmi3SetFloat64", variables, values.ctypes.data)
        return self._checked(call, Activity.SETTING, f"setting {', '.join(names)}", values)

    def reader(self, variables: Sequence[FmuVariable], values: Array) -> Callable[[], None]:
        """Return a function that reads variables into an array when it is called.

        Parameters
        ----------
        variables
            Reals first, then integers.
        values
            Shape (n,), contiguous; the function writes it.
        """
        reals = [v for v in variables if v.kind == "real"]
        integers = [v for v in variables if v.kind != "real"]
        numbers = np.zeros(len(integers), dtype=np.int32)
        real = self._access("fmi2GetReal" if self._two else "fmi3GetFloat64", reals, values.ctypes.data)
        read = self._checked(real, Activity.READING, "reading", values)
        if not integers:
            return read
        whole = self._access("fmi2GetInteger" if self._two else "fmi3GetInt32", integers, numbers.ctypes.data)
        read_whole = self._checked(whole, Activity.READING, "reading", numbers)

        def read_all() -> None:
            if reals:
                read()
            read_whole()
            values[len(reals) :] = numbers

        return read_all

    def _access(self, function: str, variables: Sequence[FmuVariable], place: int) -> Callable[[], int]:
        """Return a call that sets or reads variables at one place in memory."""
        references = (ctypes.c_uint32 * max(1, len(variables)))(*[v.reference for v in variables])
        native = self._fmu.dll[function]
        component, count, at = self._fmu.component, len(variables), ctypes.addressof(references)
        void, size = ctypes.c_void_p, ctypes.c_size_t
        if self._two:
            native.argtypes = [void, void, size, void]
            # The default keeps the references alive as long as the call.
            return lambda _kept=references: int(native(component, at, count, place))  # type: ignore[misc]
        native.argtypes = [void, void, size, void, size]
        return lambda _kept=references: int(native(component, at, count, place, count))  # type: ignore[misc]

    def _checked(self, call: Callable[[], int], activity: int, what: str, kept: Any) -> Callable[[], None]:
        """Return a call that raises where the FMU refuses; ``kept`` stays alive as long as it."""
        watch, name = self._watch, self.name

        def checked(_kept: Any = kept) -> None:
            watch(name, activity)
            status = call()
            if status > _WARNING:
                raise ExportError(f"instance '{name}', {what}", _why(self.messages, f"status {status}"))

        return checked

    def _step_function(self) -> Callable[[float, float], int]:
        native, component = self._fmu.dll["fmi2DoStep" if self._two else "fmi3DoStep"], self._fmu.component
        void, double, flag = ctypes.c_void_p, ctypes.c_double, ctypes.c_int if self._two else ctypes.c_bool
        if self._two:
            native.argtypes = [void, double, double, flag]
            return lambda time, length: int(native(component, time, length, 0))
        native.argtypes = [void, double, double, flag, void, void, void, void]
        flags = [ctypes.c_bool() for _ in range(3)]
        last = ctypes.c_double()
        event, end, early = (ctypes.addressof(flag) for flag in flags)
        reached = ctypes.addressof(last)

        def step(time: float, length: float, _kept: Any = (flags, last)) -> int:
            return int(native(component, time, length, False, event, end, early, reached))

        return step

    def step(self, time: float, length: float) -> None:
        """Advance by one communication step.

        Parameters
        ----------
        time, length
            Communication point and step in s.

        Raises
        ------
        ConvergenceError
            With the message of the FMU if it cannot.
        """
        self._watch(self.name, Activity.STEPPING)
        status = self._step(time, length)
        if status > _WARNING:
            raise ConvergenceError(
                f"instance '{self.name}', step from {time:g} s", _why(self.messages, f"status {status}")
            )

    def keep_state(self) -> Any:
        """Return a copy of the state, to be given back to :meth:`forget_state`."""
        self._watch(self.name, Activity.ROLLING_BACK)
        with self._explained("keeping its state"):
            return self._fmu.getFMUstate() if self._two else self._fmu.getFMUState()

    def restore_state(self, state: Any) -> None:
        """Go back to a state that was kept.

        Parameters
        ----------
        state
            From :meth:`keep_state`.
        """
        self._watch(self.name, Activity.ROLLING_BACK)
        with self._explained("going back to an earlier state"):
            (self._fmu.setFMUstate if self._two else self._fmu.setFMUState)(state)

    def forget_state(self, state: Any) -> None:
        """Free a state that was kept.

        Parameters
        ----------
        state
            From :meth:`keep_state`.
        """
        self._watch(self.name, Activity.ROLLING_BACK)
        with self._explained("freeing a state"):
            (self._fmu.freeFMUstate if self._two else self._fmu.freeFMUState)(state)

    def close(self) -> None:
        """Terminate, free the instance and unload its library; never fails."""
        self._watch(self.name, Activity.ENDING)
        try:
            if self._running:
                self._fmu.terminate()
        except FMICallException:
            pass  # it failed before, which was reported
        finally:
            self._fmu.freeInstance()


def _why(messages: Sequence[str], error: object) -> str:
    """Return the last message of the FMU, or that of fmpy without one."""
    return messages[-1] if messages else str(error)
