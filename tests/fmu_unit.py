"""An FMU in the hands of a test: the calls of the standard by variable name, in both versions."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from ctypes import c_double
from pathlib import Path
from typing import Any, TypeVar

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Model, FMU3Slave

from nlsdesign.export import export_fmu
from nlsdesign.model import FlatModel

VERSIONS = ("2.0", "3.0")
both = pytest.mark.parametrize("version", VERSIONS)
Refused = FMICallException
Kind = TypeVar("Kind", bound="Unit")


def exported(models: Mapping[str, FlatModel], folder: Path) -> dict[tuple[str, str], Path]:
    """FMU of each model and version."""
    return {
        (name, version): export_fmu(model, folder / f"{name}{version}.fmu", version=version)
        for name, model in models.items()
        for version in VERSIONS
    }


class Unit:
    """One instance; what it logs is kept as (status, category, message)."""

    kinds: tuple[Any, Any] = (FMU2Slave, FMU3Slave)

    def __init__(
        self, folder: str, name: str = "one", token: str | None = None, logging: bool = False
    ) -> None:
        self.description = fmpy.read_model_description(folder)
        self.two = self.description.fmiVersion == "2.0"
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.log: list[tuple[int, str, str]] = []
        self.time = 0.0
        self.raw: Any = self.kinds[0 if self.two else 1](
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


class ExchangeUnit(Unit):
    """One instance for model exchange; its integrator is the test."""

    kinds = (FMU2Model, FMU3Model)

    def run(self) -> ExchangeUnit:
        """Leave the initialization mode and the first event mode."""
        super().run()
        self.update()
        self.raw.enterContinuousTimeMode()
        return self

    def update(self) -> bool:
        """Update the discrete states and tell whether continuous states have changed."""
        again, ends, nominals, changed, timed, _ = (
            self.raw.newDiscreteStates() if self.two else self.raw.updateDiscreteStates()
        )
        assert (again, ends, nominals, timed) == (False, False, False, False)
        return bool(changed)

    def event(self) -> bool:
        """Go through the event mode and tell whether continuous states have changed."""
        self.raw.enterEventMode()
        changed = self.update()
        self.raw.enterContinuousTimeMode()
        return changed

    def place(self, time: float, states: list[float]) -> None:
        """Set time and continuous states."""
        self.raw.setTime(time)
        self.time = time
        self.raw.setContinuousStates((c_double * len(states))(*states), len(states))

    def states(self) -> list[float]:
        return self._row(self.raw.getContinuousStates, self.description.numberOfContinuousStates)

    def nominals(self) -> list[float]:
        return self._row(self.raw.getNominalsOfContinuousStates, self.description.numberOfContinuousStates)

    def rates(self) -> list[float]:
        asked = self.raw.getDerivatives if self.two else self.raw.getContinuousStateDerivatives
        return self._row(asked, self.description.numberOfContinuousStates)

    def indicators(self) -> list[float]:
        return self._row(self.raw.getEventIndicators, self.description.numberOfEventIndicators)

    def _row(self, asked: Any, count: int) -> list[float]:
        row = (c_double * count)()
        asked(row, count)
        return list(row)


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
    with unpacked(path) as folder, freed(Unit(folder, **keywords)) as unit:
        yield unit


@contextmanager
def exchanging(path: Path, **keywords: Any) -> Iterator[ExchangeUnit]:
    """Load one instance for model exchange and free it again."""
    with unpacked(path) as folder, freed(ExchangeUnit(folder, **keywords)) as unit:
        yield unit


@contextmanager
def freed(unit: Kind) -> Iterator[Kind]:
    """Free an instance at the end."""
    try:
        yield unit
    finally:
        unit.raw.freeInstance()
