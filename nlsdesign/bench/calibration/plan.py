"""What a calibration would buy, before any record exists: from the information of the run that is planned."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.arrays import Array
from ...foundation.errors import ArrangementError, InfeasibleError, unknown_name
from ...foundation.text_files import write_text
from ...foundation.written_numbers import shared_prefix, without_power
from ...model import flatten
from ...model.roles import series_spring
from ...simulation import Prior
from .bench_response import bench_response
from .bench_test import CalibrationTest, FreeRunTest, HungWeightTest, LoadCellTest
from .estimate import prior_of
from .planned_run import drive_ratio, planned_bench, sweep_end
from .unknowns import Unknowns

ErrorOf = Callable[[Prior], float]
"""Size of an error, in its unit, over what is known of the numbers."""

_ANGLES = 41
_NARROWED = 0.9
"""Share of a spread below which a number is named as better known."""


class BoughtBy(NamedTuple):
    """What one calibration, or several together, would leave."""

    titles: tuple[str, ...]  # what is done
    known: Prior  # of the numbers, afterwards
    torque: Array  # standard deviation of the torque of the resting spring at each angle, N·m
    errors: Mapping[str, float]  # other errors in N·m, by name

    @property
    def title(self) -> str:
        """What is done, in words."""
        return " and ".join(self.titles) if self.titles else "nothing"

    @property
    def torque_rms(self) -> float:
        """Root mean square over the angles of the standard deviation of the torque, N·m; nan without any."""
        return float(np.sqrt(np.mean(self.torque**2))) if len(self.torque) else math.nan

    def narrowed(self, before: Prior) -> dict[str, tuple[float, float]]:
        """Return the spreads before and after of the numbers that become better known, the most so first."""
        earlier, later = before.spreads(), self.known.spreads()
        narrowed = {n: (earlier[n], s) for n, s in later.items() if s < _NARROWED * earlier[n]}
        return dict(sorted(narrowed.items(), key=lambda pair: pair[1][1] / pair[1][0]))


@dataclass(frozen=True, eq=False)
class CalibrationPlan:
    """Calibrations ranked by what they would buy.

    Parameters
    ----------
    now
        Without any.
    ranked
        The best first.
    angles
        Of the torques, in rad of the series spring.
    ranked_by
        Name of the error by which they are ranked; where it is empty the torque of the spring decides, or in
        a machine without one all numbers alike.
    left_out
        Why a kind cannot be done, by its title.
    reach
        Largest motion of the drive that was planned, by title: as far as its current allows.
    """

    now: BoughtBy
    ranked: tuple[BoughtBy, ...]
    angles: Array
    ranked_by: str = ""
    left_out: Mapping[str, str] = field(default_factory=dict)
    reach: Mapping[str, float] = field(default_factory=dict)

    def rows(self) -> list[tuple[str, ...]]:
        """Return a table: calibration, torque of the resting spring and further errors, spreads.

        Errors are in the units of :attr:`heads`.
        """
        rows, names, factor = [], tuple(self.now.errors), self._prefix()[0]
        for each in (self.now, *self.ranked):
            narrowed = list(each.narrowed(self.now.known).items())[:4]
            spreads = ", ".join(f"{n} {_per_cent(a)} → {_per_cent(b)} %" for n, (a, b) in narrowed)
            sizes = (*([each.torque_rms] if len(self.angles) else []), *(each.errors[name] for name in names))
            rows.append((each.title, *(without_power(factor * size) for size in sizes), spreads))
        return rows

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of :meth:`rows`, with the unit of the errors."""
        unit = self._prefix()[1]
        errors = (*(["spring torque at rest"] if len(self.angles) else []), *self.now.errors)
        return ("calibration", *(f"{name}, {unit}" for name in errors), "spreads, best four")

    def words(self) -> tuple[str, ...]:
        """Return what the table does not say: no spring, no spread, or one that the torque does not feel."""
        if not self.now.known.names:
            return (
                "nothing is to be calibrated: no number of the deck has a spread -> write spread = 0.1 where "
                "a number is known to a tenth",
            )
        if not len(self.angles):
            return (
                "the machine has no spring, so there is no torque of a resting spring to know better; "
                "calibrations are ranked by the spreads of all numbers alike",
            )
        if self.now.torque_rms == 0.0:
            return (
                "the torque of the resting spring is taken as exactly known: none of its numbers has a "
                "spread -> write the spread of its stiffness, or of its rubber and cam",
            )
        return ()

    def _prefix(self) -> tuple[float, str]:
        return shared_prefix([self.now.torque_rms, *self.now.errors.values()], "N*m")

    def __str__(self) -> str:
        return "\n".join(["  ".join(row) for row in (self.heads, *self.rows())] + list(self.words()))

    def to_dict(self) -> dict[str, Any]:
        """Return the table for ``plan.json``: errors before and after, and spreads by number."""
        return {
            "ranked_by": self.ranked_by
            or ("torque of the resting spring" if len(self.angles) else "spreads of all numbers"),
            "words": list(self.words()),
            "now": {"torque_rms_Nm": _plain(self.now.torque_rms), "errors": dict(self.now.errors)},
            "ranked": [
                {
                    "calibration": each.title,
                    "torque_rms_Nm": _plain(each.torque_rms),
                    "errors": dict(each.errors),
                    "spreads": {
                        name: {"before": a, "after": b}
                        for name, (a, b) in each.narrowed(self.now.known).items()
                    },
                }
                for each in self.ranked
            ],
            "left_out": dict(self.left_out),
            "reach": dict(self.reach),
        }


def _per_cent(spread: float) -> str:
    return without_power(100.0 * spread, 2)


def _plain(size: float) -> float | None:
    """Return a number as JSON can hold it."""
    return size if math.isfinite(size) else None


def what_calibration_buys(
    actuator: Assembly,
    kinds: Sequence[CalibrationTest] = (HungWeightTest(), LoadCellTest(), FreeRunTest()),
    *,
    prior: Prior | None = None,
    errors: Mapping[str, ErrorOf] | None = None,
    rank_by: str = "",
) -> CalibrationPlan:
    """Rank calibrations by what they would buy.

    Each is planned as a motion of the machine with its declared numbers, counts and noises; where the deck
    declares no noise, one is assumed. The Fisher information of all its samples is added to what is known,
    the errors of the instruments are unknowns of their own, so the result is the least covariance that such a
    record can leave to first order, the Bayesian Cramér–Rao bound. Each kind alone, and all together.

    Parameters
    ----------
    actuator
        As declared.
    kinds
        What could be done.
    prior
        What is known now; the declared spreads where it is left out.
    errors
        Further errors by name, each a function of what is known of the numbers, for instance the bound of an
        observer.
    rank_by
        Name of one of them; the torque of the resting spring where it is left out.

    Raises
    ------
    UnknownNameError
        If there is no error of that name.
    """
    known = prior_of(actuator, prior)
    wanted = dict(errors or {})
    if rank_by and rank_by not in wanted:
        raise unknown_name("error", rank_by, wanted)
    angles, slopes = _torque_slopes(actuator, known)

    def bought(titles: Sequence[str], learned: Prior) -> BoughtBy:
        sizes = {name: float(error(learned)) for name, error in wanted.items()}
        return BoughtBy(tuple(titles), learned, learned.deviation_of(slopes), sizes)

    benches, left_out = [], {}
    for kind in kinds:
        try:
            benches.append(planned_bench(flatten(kind.on_bench(actuator)), kind, known))
        except (ArrangementError, InfeasibleError) as error:
            left_out[kind.title] = str(error)  # another kind may still be possible
    purchases = [bought([b.title], _learned(Unknowns(known, [b]))) for b in benches]
    if len(benches) > 1:
        purchases.append(bought([b.title for b in benches], _learned(Unknowns(known, benches))))

    def place(each: BoughtBy) -> float:
        if rank_by:
            return each.errors[rank_by]
        # Without a spring all numbers count alike.
        return each.torque_rms if len(angles) else float(np.sum(np.log(each.known.deviations)))

    ranked = sorted(purchases, key=place)
    reach = {b.title: max(float(np.max(np.abs(r.course.motion))) for _, r in b.runs) for b in benches}
    return CalibrationPlan(bought((), known), tuple(ranked), angles, rank_by, left_out, reach)


def write_plan(plan: CalibrationPlan, folder: Path) -> Path:
    """Write the plan as ``plan.json``.

    Parameters
    ----------
    plan
        From :func:`~nlsdesign.bench.calibration.what_calibration_buys`.
    folder
        Is made where it does not exist.
    """
    file = folder / "plan.json"
    write_text(file, json.dumps(plan.to_dict(), indent=2, ensure_ascii=False) + "\n")
    return file


def _learned(unknowns: Unknowns) -> Prior:
    still = np.zeros(unknowns.count)
    slopes = np.vstack([piece.slope for _, piece, _ in unknowns.pieces(still)])
    covariance = np.asarray(np.linalg.inv(np.eye(unknowns.count) + slopes.T @ slopes), dtype=np.float64)
    return unknowns.learned(still, covariance)


def _torque_slopes(actuator: Assembly, known: Prior) -> tuple[Array, Array]:
    """Return angles, and derivatives of the relaxed torque with respect to the logarithms of the numbers."""
    if not flatten(actuator).springs:
        return np.zeros(0), np.zeros((0, len(known.names)))
    model = flatten(LoadCellTest().on_bench(actuator))
    spring = series_spring(model)
    response = bench_response(model, known, [spring.effort], balanced=False)
    end = sweep_end(model)
    angles, ratio = np.linspace(-end, end, _ANGLES), drive_ratio(model)
    slopes = np.zeros((_ANGLES, len(known.names)))
    for k, angle in enumerate(angles):
        at_rest = response.resting(ratio * float(angle), np.zeros(response.columns))
        for j, name in enumerate(response.factors):
            slopes[k, known.place(name)] = at_rest.slope[2, 0, j]
    return angles, slopes
