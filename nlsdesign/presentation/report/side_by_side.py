"""Several designs or diagnoses side by side: key figures, torque, errors, effects, numbers that differ."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...bench.discrepancy.effects.plain_names import title
from ...design.statics.equilibrium import torque_function
from ...foundation.arrays import Array
from ...foundation.errors import NlsError, ValueRangeError
from ...foundation.quantity import Quantity, three_digits, with_error, with_unit
from ...model import FlatModel
from ..figures import RecordError, curves, gap_bars
from .sections import FigureSection, Section, TableSection, TextSection, write_report
from .tables import value_in_words

_NONE = "–"
_ANGLES = 121
_HALF_TURN = 0.5 * np.pi
"""Where no contour ends, the torque is drawn to 90°."""


@dataclass(frozen=True, eq=False)
class ComparedResult:
    """One of several designs or diagnoses.

    Parameters
    ----------
    label
        Short name, different for each.
    model
        Flat model of the designed or diagnosed deck.
    numbers
        Numbers of that deck by full name.
    design
        Content of ``design.json``, where there is one.
    verdict
        Content of ``verdict.json``, where there is one.
    """

    label: str
    model: FlatModel
    _: KW_ONLY
    numbers: Mapping[str, Quantity]
    design: Mapping[str, Any] = field(default_factory=dict)
    verdict: Mapping[str, Any] = field(default_factory=dict)


def write_comparison(path: Path, results: Sequence[ComparedResult]) -> Path:
    """Write designs or diagnoses side by side as a page, and return its file.

    Parameters
    ----------
    path
        File to write, ending in ``.html``.
    results
        At least two, in the order of the columns; the first is what the others are compared with.

    Raises
    ------
    ValueRangeError
        If there are fewer than two, or two have one label.
    ExportError
        If the file cannot be written.
    """
    names = [each.label for each in results]
    if len(names) < 2 or len(set(names)) < len(names):
        rule = f"need at least two results with different labels, not {names}"
        raise ValueRangeError("comparison", rule, next_step="name two folders or more")
    sections = [_table("Key figures", key_figures(results), results, "What the results say of themselves."),
                *_torques(results), *_errors(results), *_effects(results)]  # fmt: skip
    different = differing_numbers(results)
    if different:
        caption = f"Numbers of the decks that are not the same in all; {_NONE} where a deck has none."
        sections.append(_table("Numbers that differ", different, results, caption))
    else:
        sections.append(TextSection("Numbers that differ", "None: all decks have the same numbers."))
    facts = {f"{i}": f"`{name}`" for i, name in enumerate(names, start=1)}
    return write_report(path, *sections, title=f"{len(names)} results side by side", facts=facts)


def key_figures(results: Sequence[ComparedResult]) -> dict[str, list[str]]:
    """Return the key figures as text: by what they are, one for each result."""
    rows: dict[str, Callable[[ComparedResult], str]] = {
        "deck": lambda r: r.model.name,
        "target": lambda r: {True: "met", False: "missed"}.get(r.design.get("met"), _NONE),  # type: ignore[arg-type]
        **{
            f"torque error, {share} of made springs": lambda r, s=share: _scaled(  # type: ignore[misc]
                r.design.get("rms_error_over_spreads", {}).get(s), 1e3, "mN*m"
            )
            for share in dict.fromkeys(s for r in results for s in r.design.get("rms_error_over_spreads", {}))
        },
        "torque error, exact numbers": lambda r: _scaled(r.design.get("torque_error_rms"), 1e3, "mN*m"),
        "largest cable force": lambda r: _scaled(r.design.get("largest_cable_force"), 1.0, "N"),
        "energy": lambda r: _scaled(r.design.get("energy"), 1.0, "J"),
        "limits reached": lambda r: (
            ", ".join(r.design.get("limits_reached", r.design.get("active_limits", ()))) or _NONE
        ),
        "verdict": lambda r: str(r.verdict.get("verdict", _NONE)).replace("_", " "),
        "finding": lambda r: str(r.verdict.get("headline", _NONE)),
        "error before": lambda r: _error(r, "before"),
        "error after": lambda r: _error(r, "after"),
    }
    shown = {name: [text(each) for each in results] for name, text in rows.items()}
    return {name: texts for name, texts in shown.items() if set(texts) != {_NONE}}


def differing_numbers(results: Sequence[ComparedResult]) -> dict[str, list[str]]:
    """Return the numbers of the decks that are not the same in all results: by name, one text for each."""
    names = dict.fromkeys(name for each in results for name in each.numbers)
    rows = {}
    for name in names:
        values = [each.numbers.get(name) for each in results]
        present = [each.value for each in values if each is not None]
        if len(present) < len(values) or any(not np.array_equal(v, present[0]) for v in present):
            rows[name] = [_NONE if v is None else with_unit(value_in_words(v), v.unit) for v in values]
    return rows


def _scaled(value: float | None, factor: float, unit: str) -> str:
    return _NONE if value is None else with_unit(three_digits(factor * value), unit)


def _seen(result: ComparedResult) -> tuple[float, float, float, str] | None:
    """Return error before and after, noise floor and unit, on held-out records where there are some."""
    error = result.verdict.get("error")
    if not error:
        return None
    role = next((r for r in ("held_out", "fit") if (error.get(r) or {}).get("before") is not None), None)
    floor = error.get("noise_floor")
    if role is None or not floor:
        return None
    return error[role]["before"], error[role]["after"], floor, str(error["unit"])


def _error(result: ComparedResult, when: str) -> str:
    seen = _seen(result)
    if seen is None:
        return _NONE
    value = seen[0] if when == "before" else seen[1]
    return f"{with_unit(three_digits(value), seen[3])} ({three_digits(value / seen[2])} × noise)"


def _table(
    heading: str, rows: Mapping[str, Sequence[str]], results: Sequence[ComparedResult], caption: str
) -> Section:
    columns = ("", *(each.label for each in results))
    cells = tuple((name, *texts) for name, texts in rows.items())
    return TableSection(heading, columns, cells, caption=caption)


def torque_at_rest(model: FlatModel) -> tuple[Array, Array]:
    """Return angles in rad, to the end of the contour, and the torque of the spring at rest in N·m."""
    cams = [cam for spring in model.springs for cam in spring.cams if cam.last_angle]
    last = min((model.values[cam.last_angle or ""] for cam in cams), default=_HALF_TURN)
    angles = np.linspace(0.0, last, _ANGLES)
    torque = torque_function(model)(angles.reshape(1, -1), model.start(model.parameters))
    return angles, np.array(torque, dtype=float).ravel()


def _torques(results: Sequence[ComparedResult]) -> list[Section]:
    lines, missing = {}, []
    for each in results:
        try:
            angles, torques = torque_at_rest(each.model)
        except NlsError as error:
            missing.append(f" No curve of {each.label}: {error}.")
            continue
        lines[each.label] = (np.degrees(angles), torques)
    if not lines:
        return []
    ends = "; ".join(
        f"{name} {three_digits(float(y[-1]))} N·m at {x[-1]:.1f}°" for name, (x, y) in lines.items()
    )
    figure = curves(
        lines, across="angle in degrees", up="torque in N·m",
        words=f"Torque of the springs at rest over the angle, each to the end of its contour: {ends}.",
    )  # fmt: skip
    caption = "Torque of the springs at rest, each to the end of its contour." + "".join(missing)
    return [FigureSection("Torque", figure, caption=caption)]


def _errors(results: Sequence[ComparedResult]) -> list[Section]:
    """Return the errors before and after in times the noise, so that different signals can be compared."""
    bars = []
    for each in results:
        seen = _seen(each)
        if seen is not None:
            before, after, floor, _ = seen
            bars.append(RecordError(each.label, before / floor, after / floor, 1.0, held_out=True))
    if not bars:
        return []
    figure = gap_bars(bars, unit="1", quantity="error over noise")
    caption = (
        "Error of the worst block before and after, over its noise floor, on records that no fit has seen."
    )
    return [FigureSection("Errors before and after", figure, caption=caption)]


def _effects(results: Sequence[ComparedResult]) -> list[Section]:
    rows = []
    for each in results:
        for effect in each.verdict.get("effects", ()):
            numbers = ", ".join(
                f"{p['name'].rpartition('.')[2].replace('_', ' ')} = "
                f"{with_unit(with_error(p['value'], p['standard_error']), p['unit'])}"
                for p in effect.get("parameters", ())
            )
            probability = effect.get("probability")
            rows.append(
                (each.label, effect.get("title") or title(effect["name"]), effect["location"],
                 _NONE if probability is None else f"{probability:.3g}", numbers)
            )  # fmt: skip
    if not rows:
        return []
    columns = ("result", "effect", "location", "probability", "numbers")
    return [TableSection("Effects named", columns, tuple(rows), caption="What each diagnosis added.")]
