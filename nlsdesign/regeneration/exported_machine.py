"""Everything that runs a machine, from one deck: observer, controller and both as one step, and the plant."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ..feedback.control import ScheduledTorque, joined, torque_controller
from ..feedback.observer import designed_observer
from ..foundation.errors import NlsError
from ..model import FlatModel

MACHINE = ("plant", "observer", "controller", "torque_loop")
"""What is written of a machine."""


class ExportedMachine(NamedTuple):
    """What was written of a machine."""

    files: dict[Path, str]  # paths with a few words on each
    reasons: tuple[str, ...]  # what could not be written, and why

    def content(self) -> dict[str, list[str]]:
        """Return both for JSON."""
        return {"exported": [str(path) for path in self.files], "not_exported": list(self.reasons)}

    def findings(self) -> list[str]:
        """Return both in sentences."""
        written = [f"exported: {', '.join(map(str, self.files))}"] if self.files else []
        return [*written, *self.reasons]


def export_machine(
    plant: FlatModel,
    out: Path,
    *,
    sample_time: float,
    observer: FlatModel | None = None,
    controller: FlatModel | None = None,
    spring: str | None = None,
    measured: str | None = None,
) -> ExportedMachine:
    """Write observer, controller and both as one step, as C and FMU, and the plant as FMU.

    What fails leaves the others.

    Parameters
    ----------
    plant
        Flat model of a deck; all files name it.
    out
        Folder; C stands in ``c``.
    sample_time
        Of what is computed in steps, in s.
    observer
        Of the plant; by default the one that errs least over the spread of the deck.
    controller
        Of the plant; by default the one with the usual gains.
    spring, measured
        Series spring and measured state, where the structure leaves them open.
    """
    from ..export import export_c, export_fmu  # here, as its libraries take time to load

    @cache
    def observing() -> FlatModel:
        if observer is not None:
            return observer
        return designed_observer(plant, sample_time=sample_time, spring=spring, measured=measured).model

    @cache
    def controlling() -> FlatModel:
        return controller or torque_controller(plant, law=ScheduledTorque(), sample_time=sample_time)

    models: dict[str, Callable[[], FlatModel]] = {
        "plant": lambda: plant,
        "observer": observing,
        "controller": controlling,
        "torque_loop": lambda: joined(observing(), controlling()),
    }
    files: dict[Path, str] = {}
    reasons: list[str] = []
    for name, made in models.items():
        try:
            model = made()
            if model.sample_time is not None:
                source = export_c(model, out / "c", name=name)
                files |= {source.source: f"{name} in C99", source.header: f"interface of the {name}"}
                files[source.selftest] = f"self-test of the {name}"
            files[export_fmu(model, out / f"{name}.fmu")] = f"{name} as FMU"
        except NlsError as error:
            # The others are still of use; what is lacking is told with its reason.
            reasons.append(f"the {name} is not exported: {error}")
    return ExportedMachine(files, tuple(reasons))
