"""The torque controller of a better model: what it adds, its margins, its tracking before and after."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..feedback.control import (
    ClosedLoop,
    ScheduledTorque,
    Tracking,
    encoder_loop,
    largest_torque,
    tracking,
    with_margin,
)
from ..feedback.control.laws.known_drive import KnownDrive, carried_torque, only_side, torque_at_rest
from ..foundation.quantity import three_digits
from ..model import FlatModel
from ..model.roles import measured_motion, series_spring
from ..model.transform import with_outputs
from ..simulation import Sine
from .readiness import usual_last

SHARES = (0.2, 0.6)
"""Amplitudes of the sines over the largest torque that the declared drive can hold, up to the usual angle."""
FREQUENCIES = (1.0, 4.0)
"""In Hz."""
SCATTER = 1.02
"""Largest error over that before with which a controller is no worse."""
GAIN = "controller.bandwidth"
PERIODS = 6
"""Of a sine; the last four count: of fewer, harmonics of a bent answer look like a limit cycle."""


class TrackedSine(NamedTuple):
    """How the torque follows a sine of the wanted torque under two observers and controllers."""

    amplitude: float  # N·m
    frequency: float  # Hz
    before: Tracking
    after: Tracking

    def shown(self) -> tuple[str, ...]:
        """Return the numbers, and for a loop that hunts how it does, as text."""
        loops = (
            three_digits(t.rms_error) if t.verdict.holds else str(t.verdict)
            for t in (self.before, self.after)
        )
        return (three_digits(self.amplitude), three_digits(self.frequency), *loops)


@dataclass(frozen=True, eq=False)
class RegeneratedController:
    """The controller to take, and how the machine of the better model follows sines under both.

    Parameters
    ----------
    controller
        Of the better model, or of the declared one where that follows better.
    sines
        Under observer and controller of the declared model, and under what is generated of the better one.
    added
        Parameters of the better controller that the declared one lacks: what it compensates.
    margins
        Sentence on the margins of the controller to take.
    kept
        Why the declared controller stays, and how it goes with the generated observer; empty where it is
        replaced.
    """

    controller: FlatModel
    sines: tuple[TrackedSine, ...]
    added: tuple[str, ...]
    margins: str
    kept: str = ""

    def words(self) -> tuple[str, ...]:
        """Return tracking before and after, and the margins, in sentences."""
        loops = [s.before for s in self.sines], [s.after for s in self.sines]
        errors = " → ".join(map(_followed, loops))
        added = f", which also reckons with {', '.join(self.added)}" if self.added and not self.kept else ""
        taken = self.kept or f"the controller is that of the better model{added}"
        return (
            f"Torque error of the better model under observer and controller, before → after: {errors}, "
            f"over sines of {_span([s.amplitude for s in self.sines])} N·m at "
            f"{_span([s.frequency for s in self.sines])} Hz.",
            f"{taken[0].upper()}{taken[1:]}; {self.margins}.",
        )

    def to_dict(self) -> dict[str, Any]:
        """Return what stands in ``regeneration.json``."""
        return {
            "sines": [
                {
                    "amplitude": s.amplitude,
                    "frequency": s.frequency,
                    **{which: finite(getattr(s, which).rms_error) for which in ("before", "after")},
                    **{f"{which}_is": str(getattr(s, which).verdict) for which in ("before", "after")},
                }
                for s in self.sines
            ],
            "added": list(self.added),
            "margins": self.margins,
            "kept": self.kept,
        }


def _span(values: list[float]) -> str:
    return " and ".join(f"{value:.3g}" for value in sorted(set(values)))


def _followed(tracked: Sequence[Tracking]) -> str:
    """Return the error over the sines that were followed, and how many were not and how."""
    errors = [t.rms_error for t in tracked if t.verdict.holds]
    hunting = [t.verdict for t in tracked if not t.verdict.holds]
    words = [f"{three_digits(1e3 * rms(errors))} mN·m"] if errors else []
    if hunting:
        worst = max(hunting, key=lambda verdict: (math.isnan(verdict.amplitude), verdict.amplitude))
        words.append(f"{len(hunting)} of {len(tracked)} sines not followed ({worst})")
    return " and ".join(words)


def regenerated_controller(
    declared: FlatModel,
    better: FlatModel,
    observers: tuple[FlatModel, FlatModel],
    sample_time: float,
) -> RegeneratedController:
    """Design the controller of both models, and let the machine of the better one follow sines under each.

    ``declared``, ``better``: on the bench, load fixed. ``observers``: of the declared model, and the one that
    is generated. ``sample_time`` in s. Raises an ``NlsError`` where a model has no controller.
    """
    before, declared_margins = usual_controller(declared, sample_time)
    after, margins = usual_controller(better, sample_time)
    plant = with_outputs(better, [measured_motion(better), series_spring(better).effort])
    side, last = only_side(declared), usual_last(declared)
    most = min(largest_torque(declared), abs(torque_at_rest(KnownDrive(declared), (side or 1.0) * last)))
    asked = [(share * most, frequency) for share in SHARES for frequency in FREQUENCIES]

    def tracked(observer: FlatModel, controller: FlatModel) -> list[Tracking]:
        loop = encoder_loop(plant, observer=observer, controller=controller)
        return [sine_tracking(loop, *sine, side) for sine in asked]

    old, new = tracked(observers[0], before), tracked(observers[1], after)
    sines = tuple(TrackedSine(*sine, *pair) for sine, *pair in zip(asked, old, new, strict=True))
    hunted, hunts = (not all(t.verdict.holds for t in each) for each in (old, new))
    error, now = (rms([t.rms_error for t in each]) for each in (old, new))
    kept = ""
    if hunts or now > SCATTER * error:
        kept = "the controller stays that of the declared model"
        kept += ": under that of the better model the loop hunts" if hunts else ", which follows better"
    if hunts and hunted:
        kept += ", and so does that of the declared model: neither is fit for the machine"
    elif kept and observers[0] is not observers[1]:
        kept += f"; with the generated observer: {_followed(tracked(observers[1], before))}"
    if kept:
        margins = f"on the declared machine {declared_margins}"
    added = tuple(sorted(set(after.values) - set(before.values)))
    return RegeneratedController(before if kept else after, sines, added, margins, kept)


def usual_controller(model: FlatModel, sample_time: float) -> tuple[FlatModel, str]:
    """Return the controller that is generated where nobody states a gain, and a sentence on its margins."""
    return with_margin(
        model, GAIN, last=usual_last(model), given=False, sample_time=sample_time, law=ScheduledTorque()
    )


def sine_tracking(loop: ClosedLoop, amplitude: float, frequency: float, side: float) -> Tracking:
    """Return how the torque follows the last periods of a sine."""
    stop = PERIODS / frequency
    wanted = Sine(amplitude, frequency, offset=1.25 * side * amplitude)
    run = loop.run(stop, inputs={loop.desired: wanted})
    # What rubs in the tie of the spring is no torque of the spring: neither sensor nor observer has it.
    carried = run[f"plant.{carried_torque(KnownDrive(loop.plant))}"]
    run = run.with_signals({loop.torque: carried}, {})
    return tracking(loop, run, settled=stop - (PERIODS - 2) / frequency)


def rms(values: Sequence[float]) -> float:
    """Return the root mean square; not a number of nothing."""
    return math.sqrt(math.fsum(v * v for v in values) / len(values)) if values else math.nan


def finite(value: float) -> float | None:
    """Return a number that JSON can hold, or ``None``."""
    return value if math.isfinite(value) else None
