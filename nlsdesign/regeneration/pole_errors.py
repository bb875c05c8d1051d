"""Poles that were fitted to records: the torque errors with them, and what makes these mean little."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..bench.identification import agreement
from ..feedback.observer import DesignedObserver, ObserverDesign
from ..foundation.quantity import three_digits, typeset_unit
from ..foundation.written_numbers import shared_prefix
from ..model import FlatModel
from ..model.roles import passed_ends
from .watched_records import WatchedRecord

FOREIGN = 50.0
"""Average relative error after the fit in per cent beyond which a record shows another torque than the
deck's. Records of the declared actuator stay below 20, those with a wrong sign or unit are beyond 95."""


class PoleError(NamedTuple):
    """Error of the estimated torque on one record: rms in its unit, and average percent relative error."""

    record: str
    role: str
    # before, after: with the gain of the cascade, and with the fitted poles
    before: float
    after: float
    # percent_before, percent_after: not a number where the record shows no torque
    percent_before: float
    percent_after: float
    ratio: float  # by which the estimate with the gain of the cascade exceeds what is shown, in least squares

    @classmethod
    def of(cls, run: WatchedRecord, published: ObserverDesign, fitted: ObserverDesign) -> PoleError:
        """Return the errors over the samples that count."""
        torque = run.torque[run.skipped :]
        both = [run.estimate(design)[run.skipped :] for design in (published, fitted)]
        before, after = (agreement(torque, estimate) for estimate in both)
        power = float(torque @ torque)
        ratio = float(both[0] @ torque) / power if power > 0.0 else math.nan
        sizes = (before.rmse, after.rmse, before.relative, after.relative)
        return cls(run.record.name, run.record.role, *sizes, ratio)

    def remarks(self, model: FlatModel, run: WatchedRecord) -> Iterator[str]:
        """Yield what makes the error mean little, each with the next step."""
        name = f"record '{self.record}'"
        angles = run.trace[run.readings.get(run.motion, run.motion)]
        furthest = float(np.max(np.abs(angles)))
        for cam, end in passed_ends(model, float(np.min(angles)), float(np.max(angles))).items():
            yield (
                f"{name}: {run.motion} goes to {math.degrees(furthest):.4g}°, the contour of {cam} ends at "
                f"{math.degrees(end):.4g}° -> check unit and mapping of the angle, or declare a longer one"
            )
        if math.isnan(self.percent_after):
            yield f"{name}: no torque in it -> leave it out, or map the column of torque or force"
        elif self.percent_after > FOREIGN:
            yield (
                f"{name}: with fitted poles the torque is still {three_digits(self.percent_after)} % off, "
                f"with the gain of the cascade {self.ratio:.3g} times what is shown: this is not the torque "
                "of the deck -> check sign, unit and mapping of torque or force, and of the angle"
            )
        if self.after > self.before:
            yield (
                f"{name}, {self.role.replace('_', ' ')}: the fit makes it worse, to "
                f"{self.after / self.before:.3g} times the error with the gain of the cascade -> keep that "
                "gain (leave --fit-poles out), or fit to records of more motions"
            )


@dataclass(frozen=True, eq=False, repr=False)
class FittedPoles:
    """The published observer with poles that were fitted to records."""

    design: ObserverDesign
    # poles: in 1/s, of what is seen through the angle; the last is that of the extension
    poles: tuple[complex, ...]
    # worst: angle in rad, at or between points of the table, where the error decays most slowly, and the
    # spectral radius there
    worst: tuple[float, float]
    errors: tuple[PoleError, ...]  # by record; those that were held out decided nothing
    settling: float  # time in s from the begin of each record that no error counts, a quarter of it at most
    deciding: str  # role of the records by which one of several fits was taken
    evaluations: int  # how often records were simulated by the search
    by: str  # how the poles were sought; one of SEARCHES
    at_end: tuple[str, ...]  # states whose pole ended at an end of the range of the search
    remarks: tuple[str, ...]  # on the records, and what makes their errors mean little

    @property
    def margin(self) -> float:
        """Least decay of the error at a standing angle, in 1/s."""
        return slowest_decay(self.worst, self.design)

    @property
    def reason(self) -> str:
        """The poles and their margin in a sentence."""
        plant = self.design.step.plant
        placed = ", ".join(f"{p:.4g}" for p in self.poles)
        ended = f", at the end of its range for {' and '.join(self.at_end)}" if self.at_end else ""
        return (
            f"poles at {placed} 1/s for {', '.join(plant.pole_order)}, fitted by {self.by}{ended}, "
            f"not fitted for {', '.join(plant.measured)}; at a standing angle the error decays with at least "
            f"{self.margin:.3g} 1/s (spectral radius {self.worst[1]:.5f} at {self.worst[0]:.3g} rad), of a "
            "moving one nothing is proved"
        )

    def __repr__(self) -> str:
        return f"FittedPoles: {self.reason}"

    @property
    def observer(self) -> DesignedObserver:
        """The observer as commands write it."""
        return DesignedObserver("published", self.design, self.reason)

    def shown(self) -> tuple[str, tuple[str, ...], list[tuple[str, ...]]]:
        """Return title, heads and rows of the table of errors."""
        unit = typeset_unit(self.design.step.plant.estimate.unit)
        factor, prefixed = shared_prefix([e.after for e in self.errors], unit)
        heads = ("record", "role", f"{prefixed} rms", "fitted", "average relative error, %", "fitted")
        rows = [
            (e.record, e.role.replace("_", " "), *(three_digits(factor * v) for v in e[2:4]),
             *(three_digits(v) for v in e[4:6]))
            for e in self.errors
        ]  # fmt: skip
        title = (
            f"Torque error from {1e3 * self.settling:.3g} ms on, after the observers have settled (a quarter "
            "of a record at most), with the gain of the cascade and with fitted poles"
        )
        return title, heads, rows

    def content(self) -> dict[str, Any]:
        """Return everything as JSON has it."""
        return {
            "poles": [[complex(p).real, complex(p).imag] for p in self.poles],
            "states": self.design.step.plant.pole_order, "at_end": self.at_end,
            "by": self.by, "decided_by": self.deciding,
            "least_decay": self.margin, "spectral_radius": self.worst[1], "at_angle": self.worst[0],
            "simulations": self.evaluations, "settling_time": self.settling,
            "errors": [error._asdict() for error in self.errors],
        }  # fmt: skip


def slowest_decay(worst: tuple[float, float], design: ObserverDesign) -> float:
    """Return the decay in 1/s of the error at the angle where it is slowest."""
    return -math.log(worst[1]) / design.step.sample_time
