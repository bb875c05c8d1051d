"""An FMU that is loaded and instantiated: its life from the library to the end, and its messages."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import fmpy
import fmpy.fmi2
import fmpy.fmi3
from fmpy.fmi1 import FMICallException

from ...foundation.errors import ConvergenceError, ExportError
from .fmu_description import FmuDescription
from .foreign_text import fit_to_show
from .isolation import Activity, Watch


class LoadedFmu:
    """An FMU that has been loaded and instantiated.

    Parameters
    ----------
    description
        Of the FMU.
    watch
        Told what is called, so that a crash can be explained.
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
            self._instantiate()
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

    def _instantiate(self) -> None:
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
