"""The observer of a machine, designed again from the better model of a diagnosis, and what that improves.

The torque that the records show is compared with what two observers make of the measured motion and current:
one designed from the declared model, one from the better model. Both read the same samples. The same is
repeated with numbers drawn from what is known of them: the declared spreads before, the covariance of the
fits after.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..bench.identification import RecordSet
from ..bench.identification.least_squares import Fit
from ..feedback.observer import (
    CorrectedDesign,
    FixedGrid,
    Grid,
    ObserverDesign,
    design_corrected_observer,
    design_observer_with_details,
)
from ..feedback.observer.scheduling.scheduled import whole_contour
from ..foundation.arrays import Array
from ..foundation.errors import NlsError
from ..foundation.quantity import three_digits, with_unit
from ..foundation.text_files import write_text
from ..foundation.work_sharing import parallel_map
from ..model import FlatModel
from ..model.roles import measured_motion, series_spring
from ..simulation import declared_prior
from .regenerated_controller import RegeneratedController, finite, regenerated_controller, rms
from .watched_records import STAND_IN, ObserverChoice, WatchedRecord, with_numbers

DRAWS = 8
"""Draws of the numbers, before and after each: enough for a root mean square over the spread."""
TIE = 0.01
"""Share by which an observer of the declared model must err less to stay: within it both are equally good, so
that of the better model is generated."""
_POINTS = 257
"""Grid points of the observers of the draws, whose tables need no finer error bound than the spread."""
_SEED = 0


class ObserverTorqueError(NamedTuple):
    """Root mean square error of the estimated torque on one record, in its unit."""

    record: str
    role: str
    # before, after: of the observers from the declared and from the better model
    before: float
    after: float
    torque: float  # root mean square of the measured torque


@dataclass(frozen=True, eq=False)
class Regeneration:
    """The observer of the better model, and the torque error before and after.

    Parameters
    ----------
    plant
        The better model.
    observer
        Cascade or corrected, whichever errs less on the records that decide: of the better model, unless one
        of the declared model errs less there; ``None`` where none can be designed.
    reasons
        Why there is no observer, or no comparison; empty if nothing is lacking.
    quantity, unit
        What is estimated.
    errors
        Of the cascade by record, with the nominal numbers.
    corrected
        Of the corrected observer by record, begun at the declared numbers; empty where it cannot be designed
        for both models or a record lacks an input of it.
    chosen
        Which observer was taken, and why.
    spread_before, spread_after
        Root mean square error over these records for each draw of the numbers, where an observer could be
        designed.
    course
        Time, measured torque, and both estimates on the first of these records.
    controller
        The torque controller, and how the machine follows under it; ``None`` where there is none.
    replaced
        Of the declared model's observers the one that errs least on the records that decide; ``None`` where
        nothing was compared.
    """

    plant: FlatModel
    observer: FlatModel | None
    reasons: tuple[str, ...] = ()
    quantity: str = ""
    unit: str = "N*m"
    errors: tuple[ObserverTorqueError, ...] = ()
    corrected: tuple[ObserverTorqueError, ...] = ()
    chosen: str = ""
    spread_before: tuple[float, ...] = ()
    spread_after: tuple[float, ...] = ()
    course: tuple[Array, Array, Array, Array] | None = None
    controller: RegeneratedController | None = None
    replaced: FlatModel | None = None

    @property
    def nominal(self) -> tuple[float, float]:
        """Error over all records, before and after, with the nominal numbers."""
        return _over_records(self.errors)

    @property
    def learning(self) -> tuple[float, float]:
        """Error of the corrected observer over all records, before and after."""
        return _over_records(self.corrected)

    @property
    def over_spread(self) -> tuple[float, float]:
        """Error over all records and draws, before and after."""
        return rms(self.spread_before), rms(self.spread_after)

    def words(self) -> tuple[str, ...]:
        """Return the torque error before and after in sentences; none where nothing was compared."""
        controller = self.controller.words() if self.controller else ()
        if not self.errors:
            return controller
        pairs = {
            "with the nominal numbers": self.nominal,
            "over the spread": self.over_spread,
            "that learns": self.learning,
        }
        return (
            tuple(
                f"Error of the observer of `{self.quantity}` {how}, before → after: "
                f"{three_digits(pair[0])} → {with_unit(three_digits(pair[1]), self.unit)}."
                for how, pair in pairs.items()
                if all(map(math.isfinite, pair))
            )
            + ((f"Generated is the {self.chosen}.",) if self.chosen else ())
            + controller
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``regeneration.json``."""
        keys = ("before", "after")
        return {
            "quantity": self.quantity,
            "unit": self.unit,
            "nominal": dict(zip(keys, map(finite, self.nominal), strict=True)),
            "over_spread": dict(zip(keys, map(finite, self.over_spread), strict=True)),
            "draws": {"before": list(self.spread_before), "after": list(self.spread_after)},
            "corrected": dict(zip(keys, map(finite, self.learning), strict=True)),
            "records": [each._asdict() for each in self.errors],
            "corrected_records": [each._asdict() for each in self.corrected],
            "chosen": self.chosen,
            "controller": self.controller.to_dict() if self.controller else None,
            "reasons": list(self.reasons),
        }


def _over_records(errors: Sequence[ObserverTorqueError]) -> tuple[float, float]:
    """Return the error over all records, before and after."""
    return rms([e.before for e in errors]), rms([e.after for e in errors])


def regenerate(
    declared: FlatModel,
    better: FlatModel,
    records: RecordSet,
    *,
    fits: Sequence[Fit] = (),
    choice: ObserverChoice | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Regeneration:
    """Design observer and controller again, and compare them with those from the declared model.

    Parameters
    ----------
    declared, better
        The model as declared, and the one that a diagnosis has left.
    records
        From the bench. The observer is chosen on those that selected the better model, or on those that were
        fitted without them; those held out are compared, or all without them.
    fits
        Of the better model; their covariance gives the draws of its numbers.
    choice
        What is estimated; by default the torque of the series spring, every millisecond.
    progress
        Told what is being done.

    Returns
    -------
    Regeneration
        With reasons in words where something cannot be designed or compared.
    """
    choice = choice or ObserverChoice()
    result = regenerated_observer(declared, better, records, fits=fits, choice=choice, progress=progress)
    if result.observer is None:
        return result
    progress("designing the controllers, and following sines under both")
    try:
        old = result.replaced or _designed(declared, choice).model
        controller = regenerated_controller(declared, better, (old, result.observer), choice.sample_time)
    except NlsError as error:
        return replace(result, reasons=(*result.reasons, f"no controller is compared: {error}"))
    return replace(result, controller=controller)


def regenerated_observer(
    declared: FlatModel,
    better: FlatModel,
    records: RecordSet,
    *,
    fits: Sequence[Fit],
    choice: ObserverChoice,
    progress: Callable[[str], None],
) -> Regeneration:
    """Design the observer again, and compare it with the one from the declared model."""
    progress("designing the observer of the better model")
    try:
        watched, after, instead = watched_model(declared, better, choice)
    except NlsError as error:
        return Regeneration(better, None, (f"no observer can be designed for the better model: {error}",))
    spring = series_spring(watched, choice.spring)
    known: dict[str, Any] = {"quantity": spring.effort, "unit": watched.variable(spring.effort).unit}
    try:
        before = _designed(declared, choice)
        seen = {r.name: WatchedRecord.of(watched, spring, r, choice) for r in records.records}
    except NlsError as error:
        reasons = (*instead, f"the observers are not compared: {error}")
        return Regeneration(better, after.model, reasons, **known)
    runs = [seen[r.name] for r in records.of("held_out") or records.records]
    deciding = [seen[r.name] for r in records.of("selection") or records.of("fit") or records.records]
    progress("designing the observers that learn")
    learned = [_learning(model, choice) for model in (declared, watched)]
    generated, chosen, replaced = _generated((before, after), learned, deciding)
    corrected, lacking = _compared(learned, runs)
    pairs = [(run.estimate(before), run.estimate(after)) for run in runs]
    errors = tuple(
        ObserverTorqueError(run.record.name, run.record.role, run.error(a), run.error(b), run.size)
        for run, (a, b) in zip(runs, pairs, strict=True)
    )
    progress("designing observers over the spread of the numbers")
    draws = [*_draws(declared, ()), *_draws(better, fits)]
    models = [declared] * DRAWS + [watched] * DRAWS
    spread = list(parallel_map(lambda k: _drawn_error(models[k], draws[k], runs, choice), 2 * DRAWS))
    return Regeneration(
        better,
        generated.model,
        (*instead, *lacking, *_failures(spread)),
        errors=errors,
        corrected=corrected,
        chosen=chosen,
        spread_before=tuple(e for e in spread[:DRAWS] if math.isfinite(e)),
        spread_after=tuple(e for e in spread[DRAWS:] if math.isfinite(e)),
        course=(runs[0].trace.time, runs[0].torque, *pairs[0]),
        replaced=replaced.model,
        **known,
    )


def watched_model(
    declared: FlatModel, better: FlatModel, choice: ObserverChoice
) -> tuple[FlatModel, ObserverDesign, tuple[str, ...]]:
    """Return the model whose observer stands for the better one, that observer, and why it is not its own."""
    try:
        return better, _designed(better, choice), ()
    except NlsError as error:
        instead = f"no observer can be designed for the better model: {error}; in its place stands {STAND_IN}"
        try:
            watched = with_numbers(declared, better.values)
            return watched, _designed(watched, choice), (instead,)
        except NlsError:
            raise error from None  # why the better model has none is the reason to tell


def _designed(model: FlatModel, choice: ObserverChoice, grid: Grid | None = None) -> ObserverDesign:
    return design_observer_with_details(
        model,
        estimate=series_spring(model, choice.spring).effort,
        measured=measured_motion(model, choice.measured),
        sample_time=choice.sample_time,
        grid=grid,
    )


def _learning(model: FlatModel, choice: ObserverChoice) -> CorrectedDesign | str:
    """Return the corrected observer of a model, or why there is none."""
    try:
        return design_corrected_observer(
            model,
            estimate=series_spring(model, choice.spring).effort,
            measured=measured_motion(model, choice.measured),
            sample_time=choice.sample_time,
        )
    except NlsError as error:
        # The cascade stands already; that nothing learns, and why, is one of the reasons.
        return str(error)


def _compared(
    learned: Sequence[CorrectedDesign | str], runs: Sequence[WatchedRecord]
) -> tuple[tuple[ObserverTorqueError, ...], tuple[str, ...]]:
    """Return the errors of the corrected observers, before and after, or why there are none."""
    words = "the corrected observer is not compared: "
    designs = []
    for which, each in zip(("declared", "better"), learned, strict=True):
        if isinstance(each, str):
            return (), (f"{words}none can be designed for the {which} model: {each}",)
        designs.append(each)
    lacking = sorted({name for run in runs for design in designs for name in run.lacks(design)})
    if lacking:
        return (), (f"{words}a record does not measure {', '.join(lacking)}",)
    pairs = [[run.error(run.estimate(design)) for design in designs] for run in runs]
    errors = tuple(
        ObserverTorqueError(run.record.name, run.record.role, before, after, run.size)
        for run, (before, after) in zip(runs, pairs, strict=True)
    )
    return errors, ()


def _generated(
    cascades: tuple[ObserverDesign, ObserverDesign],
    learned: Sequence[CorrectedDesign | str],
    deciding: Sequence[WatchedRecord],
) -> tuple[ObserverDesign | CorrectedDesign, str, ObserverDesign | CorrectedDesign]:
    """Return the observer that errs least on the records that decide, why in words, and the declared best.

    The first is one of the declared model where none of the better model errs less: what is worse replaces
    nothing.
    ``learned``: the corrected ones of the declared and of the better model, or why there is none.
    """
    named: list[tuple[str, ObserverDesign | CorrectedDesign, ObserverDesign | CorrectedDesign]] = [
        ("cascade", *cascades)
    ]
    corrected = [each for each in learned if not isinstance(each, str)]
    if len(corrected) == 2 and not any(run.lacks(each) for run in deciding for each in corrected):
        named.append(("corrected observer", corrected[0], corrected[1]))
    errors = [
        [rms([run.error(run.estimate(design)) for run in deciding]) for design in both] for _, *both in named
    ]
    best = min(range(len(named)), key=lambda k: errors[k][1])
    replaced = min(range(len(named)), key=lambda k: errors[k][0])
    roles = ", ".join(sorted({run.record.role.replace("_", " ") for run in deciding}))
    share = 1.0 - errors[replaced][0] / max(errors[best][1], 1e-300)
    if share > TIE:
        name, old, _ = named[replaced]
        words = (
            f"{name} of the declared model, which is not replaced: on the records that decide ({roles}) it "
            f"errs by {100.0 * share:.2g} % less than those of the better model"
        )
        return old, words, old
    name, _, design = named[best]
    if len(named) > 1:
        name += f": it errs less on the records that decide ({roles}) than the other"
    return design, name, named[replaced][1]


def _failures(spread: Sequence[float]) -> tuple[str, ...]:
    count = sum(not math.isfinite(error) for error in spread)
    words = f"for {count} of {len(spread)} draws of the numbers no observer can be designed"
    return (words,) if count else ()


def _draws(model: FlatModel, fits: Sequence[Fit]) -> list[dict[str, float]]:
    """Return draws of the numbers: from the covariance of fits, all others from their declared spreads."""
    random = np.random.default_rng(_SEED)
    fitted = {p.name for fit in fits for p in fit.parameters}
    declared = declared_prior(model)
    drawn_numbers = declared.only([n for n in declared.names if n not in fitted]).draws(DRAWS, _SEED)
    result = []
    for number in range(DRAWS):
        values = {name: float(column[number]) for name, column in drawn_numbers.items()}
        for fit in fits:
            centre = np.array([p.inward(fit.values[p.name]) for p in fit.parameters])
            drawn = random.multivariate_normal(centre, fit.covariance, method="eigh")
            for p, x in zip(fit.parameters, drawn, strict=True):
                if p.name in model.values:
                    values[p.name] = min(max(p.outward(float(x)), p.lower), p.upper)
        result.append(values)
    return result


def _drawn_error(
    model: FlatModel, values: Mapping[str, float], runs: Sequence[WatchedRecord], choice: ObserverChoice
) -> float:
    """Return the error over all records of the observer with other numbers; not a number if there is none."""
    drawn = with_numbers(model, values)
    ends = whole_contour(drawn)
    try:
        design = _designed(drawn, choice, FixedGrid(ends.lower, ends.upper, _POINTS))
        return rms([run.error(run.estimate(design)) for run in runs])
    except NlsError:
        return math.nan


def write_regeneration(result: Regeneration, folder: Path) -> tuple[Regeneration, dict[Path, str]]:
    """Write observer and controller as C and FMU, the better plant as FMU, and ``regeneration.json``.

    Parameters
    ----------
    result
        From :func:`regenerate`.
    folder
        C stands in ``c`` in it.

    Returns
    -------
    tuple
        The result, with reasons for what could not be written too; and the files of the three, with
        a few words on each.
    """
    from ..export import export_c, export_fmu  # here, as its libraries take time to load

    written: dict[Path, str] = {}
    reasons = list(result.reasons)
    controller = result.controller.controller if result.controller else None
    models = {"observer": result.observer, "controller": controller, "plant": result.plant}
    for name, model in models.items():
        if model is None:
            continue
        try:
            if name != "plant":
                source = export_c(model, folder / "c", name=name)
                written |= {source.source: f"{name} in C99", source.header: "its interface"}
            whose = " of the better model" if name == "plant" else ""  # the others may be the declared one's
            written[export_fmu(model, folder / f"{name}.fmu")] = f"{name}{whose} as FMU"
        except NlsError as error:
            reasons.append(f"the {name} is not exported: {error}")
    result = replace(result, reasons=tuple(reasons))
    content = {**result.to_dict(), "files": [str(path) for path in written]}
    write_text(folder / "regeneration.json", json.dumps(content, indent=2, ensure_ascii=False) + "\n")
    return result, written
