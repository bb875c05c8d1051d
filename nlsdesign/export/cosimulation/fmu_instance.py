"""One loaded instance of an FMU, with the same interface for FMI 2.0 and 3.0."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...foundation.arrays import Array
from ...foundation.errors import ConvergenceError, ExportError
from .fmu_description import FmuDescription, FmuScalar
from .isolation import Activity, Watch
from .loaded_fmu import LoadedFmu, why

_STEPPING = int(Activity.STEPPING)
_WARNING = 1
"""The highest status with which both versions of FMI go on."""


class FmuInstance(LoadedFmu):
    """A loaded FMU whose variables are set and read in place, and which is stepped.

    Parameters
    ----------
    description
        Of the FMU.
    watch
        Told what is called, so that a crash can be explained.
    """

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
