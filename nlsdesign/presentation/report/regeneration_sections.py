"""Sections of a report on the observer that was designed again from the better model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ...foundation.quantity import three_digits, typeset_unit
from ..figures.before_after import HeldOut, held_out_series
from .sections import Chapter, FigureSection, FileSection, KeyNumber, NumbersSection, Section, TableSection

if TYPE_CHECKING:
    # Only its type is wanted here: the module brings the compiler and fmpy along.
    from ...regeneration import Regeneration


def regeneration_sections(result: Regeneration, files: Mapping[Path, str]) -> list[Section]:
    """Return the chapter on the observer: torque error before and after, and the files.

    Parameters
    ----------
    result
        From :func:`nlsdesign.regeneration.regenerate`.
    files
        What was written, by path.
    """
    sections: list[Section] = [
        Chapter(
            "Observer from the better model",
            "The torque observer, designed from the declared (before) and from the better model (after). "
            "Both read the measured signals and are compared with the torque that the records show.",
        )
    ]
    if result.errors:
        sections += [_numbers(result), _table(result)]
    if result.course is not None:
        time, torque, before, after = result.course
        name = result.errors[0].record
        series = HeldOut(time, torque, before, after, result.quantity, result.unit, 0.0, f"Record {name}")
        sections.append(
            FigureSection(
                f"Estimated torque: {name}", held_out_series(series),
                caption=f"Above: {result.quantity}, as measured and as both observers estimate it. "
                "Below: the errors, unfiltered.",
                assumed="The measured torque is what the better model says is behind the readings.",
            )
        )  # fmt: skip
    if result.reasons:
        rows = tuple((reason,) for reason in result.reasons)
        caption = "Why something is lacking here."
        sections.append(TableSection("Not done", ("reason",), rows, caption=caption))
    if files:
        sections.append(FileSection("Files", files, caption="Written beside this report."))
    return sections


def _numbers(result: Regeneration) -> NumbersSection:
    unit = typeset_unit(result.unit)
    before, after = (three_digits(each) for each in result.nominal)
    numbers = [KeyNumber("torque error, nominal numbers", f"{before} → {after} {unit}", "before → after")]
    if result.spread_before and result.spread_after:
        before, after = (three_digits(each) for each in result.over_spread)
        counts = f"{len(result.spread_before)} and {len(result.spread_after)} draws"
        note = f"declared spreads → covariance of the fit, {counts}"
        numbers.append(KeyNumber("torque error over the spread", f"{before} → {after} {unit}", note))
    if result.adaptive:
        before, after = (three_digits(each) for each in result.learning)
        note = "learns on each record, begun at the numbers of its model"
        numbers.append(KeyNumber("adaptive observer", f"{before} → {after} {unit}", note))
    return NumbersSection("Torque error", tuple(numbers))


def _table(result: Regeneration) -> TableSection:
    unit = typeset_unit(result.unit)
    rows = tuple(
        (
            kind,
            e.record,
            e.role.replace("_", " "),
            three_digits(e.before),
            three_digits(e.after),
            three_digits(e.torque),
        )
        for kind, errors in (("cascade", result.errors), ("adaptive", result.adaptive))
        for e in errors
    )
    columns = ("observer", "record", "used", f"before in {unit}", f"after in {unit}", f"torque in {unit}")
    caption = (
        "Root mean square error of the estimated torque, and the torque itself; the cascade with nominal "
        "numbers, the adaptive observer begun with them."
        + (f" Generated is the {result.chosen}." if result.chosen else "")
    )
    return TableSection("Torque error of each record", columns, rows, caption=caption)
