"""One loaded instance of an FMU: its life and its messages, the same for FMI 2.0 and 3.0."""

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

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, ExportError
from .fmu_description import FmuDescription, FmuScalar, fit_to_show
from .isolation import Activity, Watch


class LoadedFmu:
    """An FMU that has been loaded and instantiated.

    ``watch``: told what is called, so that a crash can be explained.
    """

    def __init__(self, description: FmuDescription, watch: Watch) -> None:
        self.name = description.instance
        self.description = description
        self.messages: list[str] = []
        self.watch, self.number = watch, watch.names.index(self.name)
        self.two = description.version == "2.0"
        self._running = False
        self.watch(self.number, Activity.LOADING)
        self.fmu = self._load()
        self.watch(self.number, Activity.INSTANTIATING)
        try:

            def log(status: int, message: bytes) -> None:
                if status > 0:
                    self.messages.append(message.decode("utf-8", errors="replace"))

            if self.two:
                callbacks = fmpy.fmi2.fmi2CallbackFunctions()
                ctypes.memmove(
                    ctypes.byref(callbacks),
                    ctypes.byref(fmpy.fmi2.defaultCallbacks),
                    ctypes.sizeof(callbacks),
                )
                callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(
                    lambda _e, _n, status, _c, text: log(status, text)
                )
                self.fmu.instantiate(callbacks=callbacks)
            else:
                self.fmu.instantiate(logMessage=lambda _e, status, _c, text: log(status, text))
        except Exception as error:
            self.fmu.freeLibrary()
            raise ExportError(
                f"instance '{self.name}'", f"could not be made: {why(self.messages, error)}"
            ) from error

    def _load(self) -> Any:
        here = os.getcwd()
        kind = fmpy.fmi2.FMU2Slave if self.two else fmpy.fmi3.FMU3Slave
        try:
            return kind(
                guid=self.description.token,
                modelIdentifier=self.description.identifier,
                unzipDirectory=str(self.description.folder),
                instanceName=self.name,
                libraryPath=str(self.description.library),
            )
        except Exception as error:
            raise ExportError(
                f"instance '{self.name}'", f"its library does not load: {why((), error)}"
            ) from error
        finally:
            os.chdir(here)  # fmpy does not restore it where loading fails

    @contextmanager
    def explained(
        self, what: str, kind: type[ExportError] | type[ConvergenceError] = ExportError
    ) -> Iterator[None]:
        """Raise what the FMU refuses within with its own message."""
        try:
            yield
        except FMICallException as error:
            raise kind(f"instance '{self.name}', {what}", why(self.messages, error)) from error

    def begin(self, start: float, stop: float | None) -> None:
        """Enter the initialization mode.

        ``start``, ``stop``: times in s; ``None`` without an end.
        """
        self.watch(self.number, Activity.INITIALIZING)
        with self.explained("initialization"):
            if self.two:
                self.fmu.setupExperiment(startTime=start, stopTime=stop)
                self.fmu.enterInitializationMode()
            else:
                self.fmu.enterInitializationMode(startTime=start, stopTime=stop)

    def run(self) -> None:
        """Leave the initialization mode."""
        self.watch(self.number, Activity.INITIALIZING)
        with self.explained("initialization"):
            self.fmu.exitInitializationMode()
        self._running = True

    def close(self) -> None:
        """Terminate, free the instance and unload its library; never fails."""
        self.watch(self.number, Activity.ENDING)
        try:
            if self._running:
                self.fmu.terminate()
        except FMICallException:
            pass  # it failed before, which was reported
        finally:
            self.fmu.freeInstance()


def why(messages: Sequence[str], error: object) -> str:
    """Return the last message of the FMU, or the error without one, made fit to be shown."""
    return fit_to_show(messages[-1] if messages else error)


_STEPPING = int(Activity.STEPPING)
_WARNING = 1
"""The highest status with which both versions of FMI go on."""


class FmuInstance(LoadedFmu):
    """A loaded FMU whose variables are set and read in place, and which is stepped."""

    def __init__(self, description: FmuDescription, watch: Watch) -> None:
        super().__init__(description, watch)
        try:
            self._step = self._step_function()
        except AttributeError as error:
            raise ExportError(f"instance '{self.name}'", f"could not be made: {error}") from error

    def set(self, values: Mapping[str, float]) -> None:
        """Set variables."""
        for name, value in values.items():
            variable = self.description.variables[name]
            self.watch(self.number, Activity.SETTING)
            with self.explained(f"setting {name}"):
                if variable.kind == "real":
                    (self.fmu.setReal if self.two else self.fmu.setFloat64)([variable.reference], [value])
                else:
                    (self.fmu.setInteger if self.two else self.fmu.setInt32)(
                        [variable.reference], [int(value)]
                    )

    def setter(self, names: Sequence[str], values: Array) -> Callable[[], None]:
        """Return a function that sets real variables to what an array holds when it is called.

        ``values``: shape (n,), contiguous; the function reads it.
        """
        variables = [self.description.variables[name] for name in names]
        call = self._access("fmi2SetReal" if self.two else "fmi3SetFloat64", variables, values.ctypes.data)
        return self._checked(call, Activity.SETTING, f"setting {', '.join(names)}", values)

    def reader(self, variables: Sequence[FmuScalar], values: Array) -> Callable[[], None]:
        """Return a function that reads variables into an array when it is called.

        ``values``: shape (n,), contiguous; the function writes it.
        """
        reals = [v for v in variables if v.kind == "real"]
        integers = [v for v in variables if v.kind != "real"]
        numbers = np.zeros(len(integers), dtype=np.int32)
        real = self._access("fmi2GetReal" if self.two else "fmi3GetFloat64", reals, values.ctypes.data)
        read = self._checked(real, Activity.READING, "reading", values)
        if not integers:
            return read
        whole = self._access("fmi2GetInteger" if self.two else "fmi3GetInt32", integers, numbers.ctypes.data)
        read_whole = self._checked(whole, Activity.READING, "reading", numbers)

        def read_all() -> None:
            if reals:
                read()
            read_whole()
            values[len(reals) :] = numbers

        return read_all

    def _access(self, function: str, variables: Sequence[FmuScalar], place: int) -> Callable[[], int]:
        """Return a call that sets or reads variables at one place in memory."""
        references = (ctypes.c_uint32 * max(1, len(variables)))(*[v.reference for v in variables])
        native = self.fmu.dll[function]
        component, count, at = self.fmu.component, len(variables), ctypes.addressof(references)
        void, size = ctypes.c_void_p, ctypes.c_size_t
        if self.two:
            native.argtypes = [void, void, size, void]
            # The default keeps the references alive as long as the call.
            return lambda _kept=references: int(native(component, at, count, place))  # type: ignore[misc]
        native.argtypes = [void, void, size, void, size]
        return lambda _kept=references: int(native(component, at, count, place, count))  # type: ignore[misc]

    def _checked(self, call: Callable[[], int], activity: int, what: str, kept: Any) -> Callable[[], None]:
        """Return a call that raises where the FMU refuses; ``kept`` stays alive as long as it."""
        watch, number, name, activity = self.watch, self.number, self.name, int(activity)

        def checked(_kept: Any = kept) -> None:
            watch(number, activity)
            status = call()
            if status > _WARNING:
                raise ExportError(f"instance '{name}', {what}", why(self.messages, f"status {status}"))

        return checked

    def _step_function(self) -> Callable[[float, float], int]:
        native, component = self.fmu.dll["fmi2DoStep" if self.two else "fmi3DoStep"], self.fmu.component
        void, double, flag = ctypes.c_void_p, ctypes.c_double, ctypes.c_int if self.two else ctypes.c_bool
        if self.two:
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
        """Advance by one communication step."""
        self.watch(self.number, _STEPPING)
        status = self._step(time, length)
        if status > _WARNING:
            raise ConvergenceError(
                f"instance '{self.name}', step from {time:g} s", why(self.messages, f"status {status}")
            )

    def keep_state(self) -> Any:
        """Return a copy of the state, to be given back to :meth:`forget_state`."""
        self.watch(self.number, Activity.ROLLING_BACK)
        with self.explained("keeping its state"):
            return self.fmu.getFMUstate() if self.two else self.fmu.getFMUState()

    def restore_state(self, state: Any) -> None:
        """Go back to a state that was kept."""
        self.watch(self.number, Activity.ROLLING_BACK)
        with self.explained("going back to an earlier state"):
            (self.fmu.setFMUstate if self.two else self.fmu.setFMUState)(state)

    def forget_state(self, state: Any) -> None:
        """Free a state that was kept."""
        self.watch(self.number, Activity.ROLLING_BACK)
        with self.explained("freeing a state"):
            (self.fmu.freeFMUstate if self.two else self.fmu.freeFMUState)(state)
