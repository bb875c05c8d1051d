"""A live design as text: a deck and a design file that every command reads, and one archive of all."""

from __future__ import annotations

import io
import json
import math
import tomllib
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..components.assembly.deck_writer import deck_text, declare
from ..design import Contour, NumberRange, TabulatedTorque, contour_of_cam, job_of
from ..design.curves.numbers import plain
from ..design.optimisation.limits import limit_kinds
from ..design.parametric.cam_question import ChosenMachine, TargetPoint
from ..export.files import BROKEN_ARCHIVE
from ..foundation.deck import read_deck
from ..foundation.errors import DeckError, ValueRangeError
from .gallery import MOST_DECK_BYTES
from .question import LiveQuestion
from .tasks import reopened_tasks

MEMBERS = _DECK, _JOB, _BEGIN = "deck.toml", "design.toml", "live.toml"
"""Names in the archive; the commands take the first two as they are."""
_MOST_VALUES = 200
_ROWS = ("directions", "lever_arms", "slopes", "radii_of_curvature")
_MOST_ROWS = 2000
_ONSET, _SAME = 0.1, 1e-3
"""Share of the contour that is not compared, and difference of lever arms relative to the largest."""
_HEAD = "# Asked on the live page. `nlsdesign design --deck deck.toml --task design.toml` designs it anew."


@dataclass(frozen=True)
class SavedDesign:
    """A live design as three TOML texts."""

    deck: str  # the actuator with the numbers that were given
    job: str  # target, limits and what is free: a design file
    begin: str = ""  # title, points and the numbers at which the last design stood, so that it is found again


def saved(question: LiveQuestion, values: dict[str, float]) -> SavedDesign:
    """Return a question as text.

    ``values``: numbers of the last design in SI by name; empty before the first.
    """
    lines = [_HEAD, f"free = {json.dumps(list(question.free))}", "", "[target]"]
    rows = (question.target.angles, question.target.torques)
    angles, torques = (json.dumps([float(v) for v in row]) for row in rows)
    lines += [f"TabulatedTorque = {{angles = {angles}, torques = {torques}}}", "", "[limits]"]
    for name, value in question.limits.items():
        kind = limit_kinds()[name]
        lines.append(f'{name} = {{{kind.field} = "{float(value)!r} {kind.unit}"}}')
    ranges = [
        f'{{name = {json.dumps(name)}, minimum = "{float(low)!r} {question.numbers[name].unit}", '
        f'maximum = "{float(high)!r} {question.numbers[name].unit}"}}'
        for name, (low, high) in question.ranges.items()
    ]
    lines += [f"NumberRange = [{', '.join(ranges)}]"] if ranges else []
    begin = [
        f"title = {json.dumps(question.title)}",
        f"material = {json.dumps(question.machine.material)}",
        f"points = {json.dumps([[float(v) for v in point] for point in question.points])}",
        f"tasks = {json.dumps([row if row[4] else row[:4] for row in question.tasks])}",
        "",
        "[values]",
        *(f"{json.dumps(name)} = {float(value)!r}" for name, value in values.items()),
        "",
        "[motor]",
        *(f"{name} = {float(value)!r}" for name, value in question.motor.items()),
        *_contour_lines(question.machine.designed),
    ]
    return SavedDesign(deck_text(question.actuator), "\n".join(lines) + "\n", "\n".join(begin) + "\n")


def reopened(texts: SavedDesign) -> tuple[LiveQuestion, dict[str, float]]:
    """Return the question of a saved design, and the numbers at which its design stood.

    ``texts``: as :func:`saved` made them; the third may be empty.
    """
    for name, text in ((_DECK, texts.deck), (_JOB, texts.job), (_BEGIN, texts.begin)):
        if len(text.encode()) > MOST_DECK_BYTES:
            raise ValueRangeError(
                name,
                f"is larger than {MOST_DECK_BYTES / 1e3:.0f} kB",
                next_step="give the file that was saved",
            )
    actuator = declare(read_deck(texts.deck, Path(_DECK)))
    job = job_of(texts.job, Path(_JOB))
    begin = _table(texts.begin)
    target = job.target
    if not isinstance(target, TabulatedTorque) or target.weights or target.slopes:
        raise ValueRangeError(
            f"{_JOB}: target", "is no table of angles and torques without weights",
            next_step="write TabulatedTorque = {angles = [...], torques = [...]} in rad and N·m",
        )  # fmt: skip
    points = tuple(
        TargetPoint(float(a), float(t)) for a, t in zip(target.angles, target.torques, strict=True)
    )
    limits, ranges = _limits_of(job.keep)
    machine = ChosenMachine(actuator, str(begin.get("material", ""))[:100])
    machine = replace(machine, designed=_contour_of(begin, machine))
    question = LiveQuestion(
        machine, points, limits, (), ranges, title=str(begin.get("title", actuator.name))[:100]
    )
    given = [each for each in begin.get("points", []) if isinstance(each, list) and len(each) == 2]
    if len(given) == 2 and len(points) == 3:
        question = replace(question, points=(points[0], points[2]))
    free = (question.contour,) if job.free is None else tuple(str(each) for each in job.free)
    for name in (*free, *ranges):
        if name != question.contour:
            question.number(name)
    question = reopened_tasks(replace(question, free=free), begin.get("tasks"), begin.get("motor"))
    return question.with_points(question.points), _values(begin)


def _contour_lines(contour: Contour | None) -> list[str]:
    """Return the contour that was designed: that of the cam in the deck, fitted to it, ripples."""
    if contour is None:
        return []
    rows = {name: json.dumps([float(v) for v in getattr(contour, name)]) for name in _ROWS}
    end = f"anchor_distance = {float(contour.anchor_distance)!r}"
    return ["", "[contour]", end, *(f"{name} = {row}" for name, row in rows.items())]


def _contour_of(begin: dict[str, Any], machine: ChosenMachine) -> Contour | None:
    """Return the contour to which the cam was fitted, where the text holds it and it is that."""
    table = begin.get("contour")
    if table is None:
        return None
    try:
        rows = [np.array(table[name], dtype=float) for name in _ROWS]
        contour = Contour(rows[0], rows[1], rows[2], rows[3], float(table["anchor_distance"]))
        fitted = contour_of_cam(machine.assembly[machine.cam.name])
        sound = len({row.shape for row in rows}) == 1 and 4 <= rows[0].size <= _MOST_ROWS
        sound = sound and bool(np.all(np.isfinite(rows)) and np.all(np.diff(rows[0]) > 0.0))
        # Near angle zero the cam sets in or changes sides, and is no contour there.
        behind = fitted.angles > _ONSET * fitted.angles[-1]
        arms = np.interp(fitted.angles, contour.angles, contour.lever_arms)[behind]
        apart = float(np.max(np.abs(arms - fitted.lever_arms[behind]))) if sound else math.inf
        same = apart <= _SAME * float(np.max(fitted.lever_arms))
    except (KeyError, TypeError, ValueError):
        same = False
    if not same:
        raise ValueRangeError(
            f"{_BEGIN}: [contour]", "is not the contour to which the cam of deck.toml was fitted",
            next_step="leave it out, or save the design again",
        )  # fmt: skip
    return contour


def _limits_of(keep: tuple[Any, ...]) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    limits: dict[str, float] = {}
    ranges: dict[str, tuple[float, float]] = {}
    for limit in keep:
        name = type(limit).__name__
        if isinstance(limit, NumberRange):
            ranges[limit.name] = (plain(limit.minimum), plain(limit.maximum))
        elif name in limit_kinds() and name not in limits:
            limits[name] = limit_kinds()[name].value_of(limit)
        else:
            raise ValueRangeError(
                f"{_JOB}: limit {name}", "is twice there, or is none of the live design",
                next_step=f"those are: {', '.join([*limit_kinds(), 'NumberRange'])}",
            )  # fmt: skip
    return limits, ranges


def _table(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise DeckError(_BEGIN, f"is no TOML: {error}", next_step="leave it out, or save again") from None


def _values(begin: dict[str, Any]) -> dict[str, float]:
    table = begin.get("values", {})
    if not isinstance(table, dict):
        return {}
    return {
        str(name): float(value)
        for name, value in list(table.items())[:_MOST_VALUES]
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    }


_OLD = (1980, 1, 1, 0, 0, 0)
"""Date of the members, so that the same design gives the same bytes."""


def archived(design: SavedDesign) -> bytes:
    """Return a saved design as an archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in zip(MEMBERS, (design.deck, design.job, design.begin), strict=True):
            archive.writestr(zipfile.ZipInfo(name, _OLD), text)
    return buffer.getvalue()


def unarchived(content: bytes) -> SavedDesign:
    """Return the design of an archive; only its three members are read, and no more than they may hold."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            texts = [_member(archive, name) for name in MEMBERS]
    except UnicodeDecodeError:  # one of the errors of value that follow
        raise DeckError("saved design", "holds what is no text in UTF-8", next_step="save it again") from None
    except (KeyError, *BROKEN_ARCHIVE) as error:
        raise DeckError(
            "saved design", f"is no archive that the live page has written: {error}",
            next_step=f"take a file with {', '.join(MEMBERS)}, or open a deck",
        ) from None  # fmt: skip
    return SavedDesign(*texts)


def _member(archive: zipfile.ZipFile, name: str) -> str:
    # What the archive says of its sizes may be wrong, so no more is unpacked than is taken.
    with archive.open(name) as stream:
        content = stream.read(MOST_DECK_BYTES + 1)
    if len(content) > MOST_DECK_BYTES:
        raise ValueRangeError(
            name, f"is larger than {MOST_DECK_BYTES / 1e3:.0f} kB", next_step="give the file that was saved"
        )
    return content.decode("utf-8")
