"""The torque controller of the better model: what it adds, its margins, its tracking before and after."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..feedback.control import (
    ClosedLoop,
    ScheduledTorque,
    encoder_loop,
    largest_torque,
    tracking,
    with_margin,
)
from ..feedback.control.laws.known_drive import KnownDrive, only_side, torque_at_rest
from ..feedback.observer import CascadeGain, design_observer
from ..foundation.errors import NlsError
from ..foundation.quantity import three_digits
from ..model import FlatModel
from ..model.roles import measured_motion, series_spring
from ..model.transform import with_outputs
from ..simulation import Sine
from .range_remarks import usual_last

SHARES = (0.2, 0.6)
"""Amplitudes of the sines over the largest torque that the declared drive can hold, up to the usual angle."""
FREQUENCIES = (1.0, 4.0)
"""In Hz."""
SCATTER = 1.02
"""Largest error over that before with which a controller is no worse."""
GAIN = "controller.bandwidth"


class TrackedSine(NamedTuple):
    """Root mean square torque error on a sine of the wanted torque, in N·m; not a number in a limit cycle."""

    amplitude: float  # N·m
    frequency: float  # Hz
    before: float
    after: float


@dataclass(frozen=True, eq=False)
class RegeneratedController:
    """The controller to take, and how the machine of the better model follows sines under both.

    Parameters
    ----------
    controller
        Of the better model, or of the declared one where that follows better.
    sines
        Under observer and controller of the declared model, and of the better one.
    added
        Parameters of the better controller that the declared one lacks: what it compensates.
    margins
        Sentence on the margins of the better controller.
    kept
        Why the declared controller stays; empty where it is replaced.
    """

    controller: FlatModel
    sines: tuple[TrackedSine, ...]
    added: tuple[str, ...]
    margins: str
    kept: str = ""

    def words(self) -> tuple[str, ...]:
        """Return tracking before and after, and the margins, in sentences."""
        errors = " → ".join(three_digits(1e3 * _rms([s[place] for s in self.sines])) for place in (2, 3))
        added = f", which also reckons with {', '.join(self.added)}" if self.added and not self.kept else ""
        taken = self.kept or f"the controller is that of the better model{added}"
        return (
            f"Torque error of the better model under observer and controller, before → after: {errors} mN·m, "
            f"over sines of {_span([s.amplitude for s in self.sines])} N·m at "
            f"{_span([s.frequency for s in self.sines])} Hz.",
            f"{taken[0].upper()}{taken[1:]}; {self.margins}.",
        )

    def to_dict(self) -> dict[str, Any]:
        """Return what stands in ``regeneration.json``."""
        return {
            "sines": [
                {name: value if math.isfinite(value) else None for name, value in sine._asdict().items()}
                for sine in self.sines
            ],
            "added": list(self.added),
            "margins": self.margins,
            "kept": self.kept,
        }


def _span(values: list[float]) -> str:
    return " and ".join(f"{value:.3g}" for value in sorted(set(values)))


def _rms(values: list[float]) -> float:
    return math.sqrt(math.fsum(value * value for value in values) / len(values))


def regenerated_controller(
    declared: FlatModel, better: FlatModel, sample_time: float
) -> RegeneratedController:
    """Design observer and controller of both models, and let the machine of the better one follow sines.

    ``declared``, ``better``: on the bench, load fixed. ``sample_time`` in s. Raises an ``NlsError`` where the
    declared model has no controller, or the better one none.
    """
    before, _ = usual_controller(declared, sample_time)
    after, margins = usual_controller(better, sample_time)
    plant = with_outputs(better, [measured_motion(better), series_spring(better).effort])
    old = design_observer(declared, gain=CascadeGain(), sample_time=sample_time)
    try:
        new = design_observer(better, gain=CascadeGain(), sample_time=sample_time)
    except NlsError:
        # A law that no observer holds, as of hysteresis; its controller may still follow better.
        new, margins = old, f"{margins}; the observer in the loop is that of the declared model for both"
    loops = [
        encoder_loop(plant, observer=old, controller=before),
        encoder_loop(plant, observer=new, controller=after),
    ]
    side, last = only_side(declared), usual_last(declared)
    most = min(largest_torque(declared), abs(torque_at_rest(KnownDrive(declared), (side or 1.0) * last)))
    sines = tuple(
        TrackedSine(
            share * most, frequency, *(sine_error(loop, share * most, frequency, side) for loop in loops)
        )
        for share in SHARES
        for frequency in FREQUENCIES
    )
    kept = ""
    errors = [_rms([sine[place] for sine in sines]) for place in (2, 3)]
    if not errors[1] <= SCATTER * errors[0] and math.isfinite(errors[0]):
        kept = "the controller stays that of the declared model, which follows better"
    added = tuple(sorted(set(after.values) - set(before.values)))
    return RegeneratedController(before if kept else after, sines, added, margins, kept)


def usual_controller(model: FlatModel, sample_time: float) -> tuple[FlatModel, str]:
    """Return the controller that is generated where nobody states a gain, and a sentence on its margins."""
    return with_margin(
        model, GAIN, last=usual_last(model), given=False, sample_time=sample_time, law=ScheduledTorque()
    )


def sine_error(loop: ClosedLoop, amplitude: float, frequency: float, side: float) -> float:
    """Return the torque error over the last period of a sine; not a number in a limit cycle."""
    stop = 3.0 / frequency
    wanted = Sine(amplitude, frequency, offset=1.25 * side * amplitude)
    run = loop.run(stop, inputs={loop.desired: wanted})
    return tracking(loop, run, settled=stop - 1.0 / frequency).rms_error
