"""An FMU in the hands of a test: the calls of the standard by variable name, in both versions."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave

Refused = FMICallException


class Unit:
    """One instance; what it logs is kept as (status, category, message)."""

    def __init__(
        self, folder: str, name: str = "one", token: str | None = None, logging: bool = False
    ) -> None:
        self.description = fmpy.read_model_description(folder)
        self.two = self.description.fmiVersion == "2.0"
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.log: list[tuple[int, str, str]] = []
        self.time = 0.0
        self.raw: Any = (FMU2Slave if self.two else FMU3Slave)(
            guid=token or self.description.guid,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            unzipDirectory=folder,
            instanceName=name,
        )
        try:
            if self.two:
                callbacks = fmi2CallbackFunctions()
                callbacks.logger = fmi2CallbackLoggerTYPE(lambda _e, _n, *rest: self._keep(*rest))
                self.raw.instantiate(callbacks=callbacks, loggingOn=logging)
            else:
                self.raw.instantiate(logMessage=lambda _e, *rest: self._keep(*rest), loggingOn=logging)
        except Exception:
            self.raw.freeLibrary()
            raise

    def _keep(self, status: int, category: bytes, message: bytes) -> None:
        self.log.append((status, category.decode(), message.decode()))

    def begin(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> Unit:
        """Enter the initialization mode."""
        self.time = start
        given = {"startTime": start, "stopTime": stop, "tolerance": tolerance}
        if self.two:
            self.raw.setupExperiment(**given)
            self.raw.enterInitializationMode()
        else:
            self.raw.enterInitializationMode(**given)
        return self

    def run(self) -> Unit:
        """Leave the initialization mode."""
        self.raw.exitInitializationMode()
        return self

    def set(self, **values: float) -> None:
        """Set variables; a double underscore stands for a dot."""
        self.put({name.replace("__", "."): value for name, value in values.items()})

    def put(self, values: dict[str, float]) -> None:
        references = [self.references[name] for name in values]
        (self.raw.setReal if self.two else self.raw.setFloat64)(references, list(values.values()))

    def get(self, *names: str) -> list[float]:
        return self.get_references([self.references[name] for name in names])

    def get_references(self, references: list[int]) -> list[float]:
        return list((self.raw.getReal if self.two else self.raw.getFloat64)(references))

    def get_integer(self, reference: int) -> int:
        return int((self.raw.getInteger if self.two else self.raw.getInt32)([reference])[0])

    def step(self, length: float) -> None:
        self.raw.doStep(currentCommunicationPoint=self.time, communicationStepSize=length)
        self.time += length

    def derivative(self, unknowns: list[str], knowns: list[str], seed: list[float]) -> list[float]:
        of = [[self.references[name] for name in names] for names in (unknowns, knowns)]
        return list(self.raw.getDirectionalDerivative(*of, seed))


@contextmanager
def unpacked(path: Path) -> Iterator[str]:
    """Unpack an FMU into a folder that is removed again."""
    folder = tempfile.mkdtemp()
    try:
        yield fmpy.extract(str(path), unzipdir=folder)
    finally:
        shutil.rmtree(folder)


@contextmanager
def opened(path: Path, **keywords: Any) -> Iterator[Unit]:
    """Load one instance and free it again."""
    with unpacked(path) as folder:
        unit = Unit(folder, **keywords)
        try:
            yield unit
        finally:
            unit.raw.freeInstance()
