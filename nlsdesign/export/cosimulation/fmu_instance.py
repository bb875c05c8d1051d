"""One loaded instance of an FMU, with the same interface for FMI 2.0 and 3.0."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fmpy
import fmpy.fmi2
import fmpy.fmi3
from fmpy.fmi1 import FMICallException

from ...errors import ConvergenceError, ExportError

_REAL, _INTEGER = ("Real", "Float64"), ("Integer", "Int32")


class FmuInstance:
    """An FMU that has been unpacked, loaded and instantiated.

    Parameters
    ----------
    name
        Name of the instance, for messages.
    path
        The FMU.
    folder
        Folder for its files; the owner of the folder removes it after :meth:`close`.

    Raises
    ------
    ExportError
        If the file is no valid co-simulation FMU or has no binary for this machine.
    """

    def __init__(self, name: str, path: Path, folder: Path) -> None:
        self.name = name
        self.messages: list[str] = []
        description = _description(name, path)
        self.variables: Mapping[str, Any] = {
            v.name: v
            for v in description.modelVariables
            if v.type in _REAL + _INTEGER and not getattr(v, "dimensions", None)
        }
        self._two = description.fmiVersion == "2.0"
        self._running = False
        fmpy.extract(str(path), unzipdir=str(folder))
        kind = fmpy.fmi2.FMU2Slave if self._two else fmpy.fmi3.FMU3Slave
        self._fmu = self._load(kind, description, folder)
        try:
            self._instantiate()
        except Exception as error:
            self._fmu.freeLibrary()
            raise ExportError(
                f"instance '{name}'", f"could not be made: {_why(self.messages, error)}"
            ) from error

    def _load(self, kind: Any, description: Any, folder: Path) -> Any:
        identifier = description.coSimulation.modelIdentifier
        where = "binaries/" + (fmpy.platform if self._two else fmpy.platform_tuple)
        library = folder / where / (identifier + fmpy.sharedLibraryExtension)
        if not library.is_file():
            raise ExportError(
                f"instance '{self.name}'",
                f"the FMU has no binary for this machine ({where})",
                next_step="export it with platforms=None on this machine, or name the platform",
            )
        here = os.getcwd()
        try:
            return kind(
                guid=description.guid,
                modelIdentifier=identifier,
                unzipDirectory=str(folder),
                instanceName=self.name,
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

    @property
    def sample_time(self) -> float | None:
        """Sample time in s that the FMU states, ``None`` for a continuous one."""
        period = self.variables.get("sample.time")
        return float(period.start) if period is not None and period.variability == "constant" else None

    def unit(self, variable: str) -> str | None:
        """Return the unit of a variable, ``None`` if the FMU gives none.

        Parameters
        ----------
        variable
            Name of a variable.
        """
        described = self.variables[variable]
        return described.unit or (described.declaredType.unit if described.declaredType else None)

    def begin(self, start: float, stop: float) -> None:
        """Enter the initialization mode.

        Parameters
        ----------
        start, stop
            Times in s.
        """
        with self._explained("initialization"):
            if self._two:
                self._fmu.setupExperiment(startTime=start, stopTime=stop)
                self._fmu.enterInitializationMode()
            else:
                self._fmu.enterInitializationMode(startTime=start, stopTime=stop)

    def run(self) -> None:
        """Leave the initialization mode."""
        with self._explained("initialization"):
            self._fmu.exitInitializationMode()
        self._running = True

    def set(self, values: Mapping[str, float]) -> None:
        """Set variables.

        Parameters
        ----------
        values
            Numbers in SI by name.

        Raises
        ------
        ExportError
            With the message of the FMU if it refuses.
        """
        if values:
            references = [self.variables[name].valueReference for name in values]
            with self._explained(f"setting {', '.join(values)}"):
                (self._fmu.setReal if self._two else self._fmu.setFloat64)(references, list(values.values()))

    def get(self, names: Sequence[str]) -> dict[str, float]:
        """Return the values of variables.

        Parameters
        ----------
        names
            Names of real or integer variables.

        Raises
        ------
        ExportError
            With the message of the FMU if it refuses.
        """
        values: dict[str, float] = {}
        real, integer = (self._fmu.getReal, self._fmu.getInteger) if self._two else (
            self._fmu.getFloat64, self._fmu.getInt32,
        )  # fmt: skip
        for types, read in ((_REAL, real), (_INTEGER, integer)):
            chosen = [name for name in names if self.variables[name].type in types]
            if chosen:
                with self._explained("reading"):
                    numbers = read([self.variables[name].valueReference for name in chosen])
                values |= {name: float(number) for name, number in zip(chosen, numbers, strict=True)}
        return values

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
        with self._explained(f"step from {time:g} s", ConvergenceError):
            self._fmu.doStep(currentCommunicationPoint=time, communicationStepSize=length)

    def close(self) -> None:
        """Terminate, free the instance and unload its library; never fails."""
        try:
            if self._running:
                self._fmu.terminate()
        except FMICallException:
            pass  # it failed before, which was reported
        finally:
            self._fmu.freeInstance()


def _why(messages: Sequence[str], error: BaseException) -> str:
    """Return the last message of the FMU, or that of fmpy without one."""
    return messages[-1] if messages else str(error)


def _description(name: str, path: Path) -> Any:
    try:
        description = fmpy.read_model_description(str(path))
    except Exception as error:
        raise ExportError(f"instance '{name}' ({path})", f"is not a valid FMU: {error}") from error
    if description.coSimulation is None or description.fmiVersion == "1.0":
        raise ExportError(f"instance '{name}' ({path})", "is not a co-simulation FMU of FMI 2.0 or 3.0")
    return description
