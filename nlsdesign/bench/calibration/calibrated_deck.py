"""A calibrated machine as a deck: values, spreads and where they come from; and what was known jointly."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...components.assembly.named_parts import Assembly
from ...foundation.deck import Written
from ...foundation.errors import ExportError, MeasurementError, NlsError
from ...foundation.quantity import Quantity, parse_unit, three_digits, to_resolution, typeset_unit, with_unit
from ...foundation.spread import NormalSpread, RelativeSpread
from ...foundation.text_files import text_of, write_text
from ...model.origin import derived
from ...simulation import Prior
from .bench_response import shared_factors
from .estimate import FITS, Estimate

_CHANGE = "calibrated"
_MOVED = 0.01
"""Standard deviations of the prior, or share of them, below which a number is left as it was declared."""
_TOGETHER = 1.0 / 3.0
"""A product or quotient is told where it is known so many times better than either of its numbers."""
_LISTED_PRODUCTS = 8
_RARE = 0.0027
"""Chance below which all numbers together are suspect: three standard deviations of one."""


class CalibratedNumber(NamedTuple):
    """One number before and after."""

    name: str
    unit: str
    # before, after: values in SI
    before: float
    after: float
    # spread_before, spread_after: relative
    spread_before: float
    spread_after: float
    strain: float  # how far it moved, in standard deviations of what was known
    told_by: str  # what it is known from; empty where the records say nothing of it
    members: int = 1  # how many numbers of a row share its factor; the first stands for all


@dataclass(frozen=True, eq=False)
class CalibratedMachine:
    """A machine with calibrated numbers."""

    actuator: Assembly  # with new values, spreads and sources
    estimate: Estimate  # what was found
    numbers: tuple[CalibratedNumber, ...]  # those that became better known or moved, in the order of the deck
    kept: tuple[str, ...] = ()  # numbers that the deck cannot take as they were found, with the reason

    @property
    def declared_name(self) -> str:
        """Name of the deck that was calibrated."""
        parent = self.actuator.parent
        return parent.name if parent and parent.change == _CHANGE else self.actuator.name

    def together(self) -> tuple[str, ...]:
        """Return products and quotients that are known far better than either of their numbers."""
        known = self.estimate.after
        names = [n.name for n in self.numbers]
        shown = [first for first in shared_factors(known) if first in names]
        products = []
        for i, first in enumerate(shown):
            for second in shown[i + 1 :]:
                a, b = (known.deviations[known.place(n)] for n in (first, second))
                mixed = known.covariance[known.place(first), known.place(second)]
                for sign, relation in ((1.0, "times"), (-1.0, "over")):
                    joint = math.sqrt(max(a * a + b * b + 2.0 * sign * mixed, 0.0))
                    if joint < _TOGETHER * min(a, b):
                        products.append((joint / min(a, b), first, relation, second, joint, a, b))
        best_known = sorted(products)[:_LISTED_PRODUCTS]
        return tuple(
            f"{first} {relation} {second} is known to {_percent(joint)}, the numbers alone to {_percent(a)} "
            f"and {_percent(b)}."
            for _, first, relation, second, joint, a, b in best_known
        )

    def words(self) -> tuple[str, ...]:
        """Return what a table does not say: suspects, misfits, combinations, what the deck cannot hold."""
        estimate = self.estimate
        suspect = [
            f"suspect: {name} moved by {estimate.strain[name]:+.1f} standard deviations of what was "
            f"declared, {abs(estimate.doubt[name]):.1f} times what such records would by chance: its "
            "declared value or spread, or that of another number of the same product, is wrong, or the "
            "records show something that the deck lacks; ask `nlsdesign diagnose`."
            for name in estimate.suspects
        ]
        if estimate.chance < _RARE and not suspect:
            most = sorted(estimate.strain, key=lambda name: -abs(estimate.strain[name]))[:4]
            suspect = [
                "suspect: taken together the numbers moved further than their spreads allow (one machine in "
                f"{1.0 / max(estimate.chance, 1e-12):.0g} would), most of all {', '.join(most)}: a declared "
                "value or spread is wrong, or the records show something that the deck lacks."
            ]
        misfit = [
            f"The model misses '{m.channel}' of record '{m.record}' by "
            f"{with_unit(three_digits(m.residual), m.unit)}, {three_digits(m.ratio)} times its noise; "
            f"standard deviations were widened by {three_digits(estimate.inflated)}."
            for m in estimate.misfits
            if m.ratio > FITS
        ]
        joint = [
            "A deck holds the spread of each number alone; what is known of products and quotients stands in "
            "joint_numbers.json."
        ]
        return (*suspect, *misfit, *self.together(), *self.kept, *(joint if self.together() else ()))

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``calibration.json``."""
        return {
            "numbers": [n._asdict() for n in self.numbers],
            "suspects": list(self.estimate.suspects),
            "chance": self.estimate.chance,
            "widened_by": self.estimate.inflated,
            "records": [{**m._asdict(), "ratio": m.ratio} for m in self.estimate.misfits],
            "words": list(self.words()),
            "files": list(self.estimate.files),
        }


def calibrated(actuator: Assembly, estimate: Estimate, *, day: date | None = None) -> CalibratedMachine:
    """Return a machine with the numbers that a calibration has estimated.

    A row of numbers has one spread in a deck: it takes the largest of its numbers, so nothing is called
    better known than it is.

    Parameters
    ----------
    actuator
        As declared.
    estimate
        From :func:`~nlsdesign.bench.calibration.estimate`.
    day
        Of the calibration, for the source; today where it is left out.
    """
    before, after = estimate.before, estimate.after
    strain = {m: estimate.strain[first] for first, ms in shared_factors(before).items() for m in ms}
    spreads, earlier = after.spreads(), before.spreads()
    changed = [
        k
        for k, name in enumerate(before.names)
        if abs(strain[name]) > _MOVED or after.deviations[k] < (1.0 - _MOVED) * before.deviations[k]
    ]
    quantities = actuator.quantities()
    rows: dict[str, list[int]] = {}
    for k in changed:
        rows.setdefault(before.names[k].partition("[")[0], []).append(k)
    when = (day or date.today()).isoformat()
    files = ", ".join(Path(f).name or f for f in estimate.files)
    kept = []
    machine = actuator
    for name, places in rows.items():
        new = {
            name: _calibrated_row(quantities[name], name, places, estimate, f"calibrated {when} from {files}")
        }
        try:
            machine = machine.with_values(new)
        except NlsError as error:
            kept.append(f"{name} stays as declared: {error}")  # the others are still of use
    shared = shared_factors(before)
    shared = shared_factors(before)
    refused = {text.partition(" ")[0] for text in kept}
    taken = [
        k for k in changed if before.names[k] in shared and before.names[k].partition("[")[0] not in refused
    ]
    numbers = tuple(
        CalibratedNumber(
            before.names[k],
            quantities[before.names[k].partition("[")[0]].unit,
            float(before.values[k]),
            float(after.values[k]),
            earlier[before.names[k]],
            spreads[before.names[k]],
            strain[before.names[k]],
            estimate.told_by.get(before.names[k], ""),
            len(shared[before.names[k]]),
        )
        for k in taken
    )
    return CalibratedMachine(derived(machine, actuator, _CHANGE), estimate, numbers, tuple(kept))


def _calibrated_row(
    old: Quantity, name: str, places: Sequence[int], estimate: Estimate, how: str
) -> Quantity:
    values, after = list(old.values), estimate.after
    names = after.names
    for k in places:
        index = int(names[k].partition("[")[2].rstrip("]")) - 1 if "[" in names[k] else 0
        factor = parse_unit(old.unit).factor
        value = float(estimate.after.values[k]) / factor
        error = after.spread_of(names[k]).standard_error(float(after.values[k])) / factor
        values[index] = Written(repr(to_resolution(value, error))).times(factor)
    members = [n for n in names if n.partition("[")[0] == name]
    spread = max((after.spread_of(n) for n in members), key=lambda each: each.share(1.0))
    if isinstance(spread, RelativeSpread):
        spread = RelativeSpread(float(f"{spread.relative:.3g}"))
    short = len(values) <= 4
    was = str(old) if short else f"{len(values)} numbers in {typeset_unit(old.unit)}"
    declared = f"{was} {old.spread_text}: {old.source}"
    value_now = tuple(values) if isinstance(old.value, tuple) else values[0]
    return replace(old.with_value(value_now, f"{how} (declared {declared})"), spread=spread)


def _percent(deviation: float) -> str:
    return f"{100.0 * math.expm1(deviation):.2g} %"


def write_calibration(
    result: CalibratedMachine, folder: Path, *, deck: Path | None = None
) -> dict[str, Path]:
    """Write the calibrated deck, what is known jointly, and the result; never over the deck that was read.

    Parameters
    ----------
    result
        From :func:`calibrated`.
    folder
        Is made where it does not exist.
    deck
        The file that was read, which is not touched.

    Returns
    -------
    dict
        Paths of ``deck``, ``joint`` and ``result``.

    Raises
    ------
    ExportError
        If the deck that was read would be overwritten, or nothing can be written.
    """
    from ...components.assembly.deck_writer import deck_text

    paths = {
        "deck": folder / f"{result.declared_name}_calibrated.toml",
        "joint": folder / "joint_numbers.json",
        "result": folder / "calibration.json",
    }
    if deck is not None and paths["deck"].resolve() == Path(deck).resolve():
        raise ExportError(
            str(deck),
            "is the deck that was calibrated, and is not overwritten",
            next_step="name another folder",
        )
    texts = {
        "deck": deck_text(result.actuator),
        "joint": _joint_text(result),
        "result": json.dumps(result.to_dict(), indent=2, ensure_ascii=False) + "\n",
    }
    for key, path in paths.items():
        write_text(path, texts[key])
    return paths


def _joint_text(result: CalibratedMachine) -> str:
    after = result.estimate.after
    machine = result.actuator.quantities()

    def value(name: str) -> float:
        row, _, place = name.partition("[")
        return machine[row].values[int(place.rstrip("]")) - 1 if place else 0]

    names = [n for n in after.names if n.partition("[")[0] in machine]
    shown = after.only(names)
    sizes = [0.0 if isinstance(k, RelativeSpread) else k.slope(0.0) for k in shown.kinds]
    straight = "; where sizes is not zero the number is its value plus size times x" if any(sizes) else ""
    content = {
        "what": "each number is its value (SI) times exp(x); the x are jointly normal with this covariance"
        + straight,
        "names": names,
        "values": [value(n) for n in names],
        "covariance": [[float(f"{c:.10g}") for c in row] for row in shown.covariance],
        **({"sizes": sizes} if any(sizes) else {}),
    }
    return json.dumps(content, indent=None, ensure_ascii=False) + "\n"


def read_joint_numbers(path: Path) -> Prior:
    """Read what a calibration has left known jointly, to plan the next one or to estimate with it as prior.

    Parameters
    ----------
    path
        ``joint_numbers.json``.

    Raises
    ------
    MeasurementError
        If the file is none.
    """
    try:
        content = json.loads(text_of(Path(path), MeasurementError))
        covariance = np.array(content["covariance"], dtype=float)
        names, sizes = tuple(content["names"]), content.get("sizes")
        relative = np.expm1(np.sqrt(np.diag(covariance))).tolist()
        return Prior(
            names,
            np.array(content["values"], dtype=float),
            0.5 * (covariance + covariance.T),
            kinds=tuple(
                NormalSpread(size) if size else RelativeSpread(share)
                for size, share in zip(sizes or [0.0] * len(names), relative, strict=True)
            ),
        )
    except (ValueError, LookupError, TypeError, RecursionError, OverflowError) as error:
        raise MeasurementError(
            str(path), f"holds no numbers that are known jointly: {error}",
            next_step="give the joint_numbers.json of a calibration",
        ) from None  # fmt: skip


def shown_numbers(numbers: Sequence[CalibratedNumber]) -> list[tuple[str, ...]]:
    """Return the rows of a table for people: name, before, after, unit, moved by, known from.

    Parameters
    ----------
    numbers
        Of a calibration.
    """
    return [
        (
            n.name if n.members == 1 else f"{n.name} and {n.members - 1} more, one factor",
            f"{n.before / parse_unit(n.unit).factor:.4g} ± {100 * n.spread_before:.2g} %",
            f"{n.after / parse_unit(n.unit).factor:.4g} ± {100 * n.spread_after:.2g} %",
            typeset_unit(n.unit),
            f"{n.strain:+.2f}",
            n.told_by or "nothing but its spread",
        )
        for n in numbers
    ]
