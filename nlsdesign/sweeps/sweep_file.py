"""A sweep in TOML: deck, axes, question; see :func:`read_sweep_file`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from ..components.assembly.deck_writer import declare
from ..components.assembly.named_parts import Assembly
from ..design import Target
from ..design.jobs.job_file import built, job_in
from ..feedback.control import TorqueGains
from ..foundation.deck import Deck, load_deck, read_deck
from ..foundation.errors import DeckError, NlsError, UnitError, brief, unknown_name
from ..foundation.quantity import parse_unit, same_dimension
from ..foundation.text_files import text_of
from ..foundation.written_numbers import split_number
from .axes import AxisSet, GridAxis, LatinHypercube, Listed, RandomDraws, SaltelliSample, SobolSample
from .axis_values import unit_of_field
from .questions import (
    QUICK,
    RECORDS,
    AngleQuestion,
    DesignQuestion,
    DiagnosisQuestion,
    LoopQuestion,
    SpreadQuestion,
)
from .run_sweep import SweepTask, require_askable, sweep_task
from .sweep_question import SweepQuestion

_TABLES: Final = ("decks", "axes", "ask")
_AXES: Final = {
    each.__name__: each
    for each in (GridAxis, Listed, SobolSample, LatinHypercube, RandomDraws, SaltelliSample)
}
_QUESTIONS: Final = {
    each.__name__: each
    for each in (DesignQuestion, AngleQuestion, SpreadQuestion, LoopQuestion, DiagnosisQuestion)
}


def read_sweep_file(path: Path | str) -> SweepTask:
    """Read and check a sweep.

    ``decks`` names the deck that is swept, or several for an axis ``deck``. ``[[axes]]`` begins each set of
    axes, ``[ask.QUESTION]`` holds the question, both with the names and fields of the Python objects. Numbers
    carry their unit; bare ones are in SI. A design is asked with the tables of a design file.

    Examples
    --------
    A file::

        decks = "austin2015_figure_consistent"

        [[axes]]
        GridAxis = {name = "spring.rubber.area", lower = "0.2 cm^2", upper = "0.8 cm^2", count = 7}

        [[axes]]
        Listed = {values = {"spring.rubber" = ["PMC-770", "Dragon_Skin_30"]}}

        [ask.DesignQuestion]
        free = ["spring.cam.contour", "spring.pretension"]
        target.ExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0}
        limits.MaximumCamRadius = {radius = "30 mm"}
    """
    file = Path(path)
    deck = read_deck(text_of(file, DeckError, next_step="give a sweep file in TOML, UTF-8"), file)
    for key in [*deck.tables, *(["deck"] if deck.head else [])]:
        if key not in _TABLES:
            raise unknown_name(deck.place(key), key, _TABLES)
    if "decks" not in deck.tables:
        raise DeckError(deck.path.name, "names no deck", next_step='write decks = "..." above the tables')
    given = deck.tables["decks"]
    given = [given] if isinstance(given, str) else given
    if not isinstance(given, list) or not given or not all(isinstance(each, str) for each in given):
        raise DeckError(deck.place("decks"), f"{brief(given)} is no list of decks", next_step='write ["..."]')
    assemblies: dict[str, Assembly] = {}
    for name in given:
        beside = file.parent / name
        read = load_deck(beside if name.endswith(".toml") and beside.exists() else name)
        short = Path(name).stem
        if short in assemblies:
            raise DeckError(deck.place("decks"), f"names '{short}' twice", next_step="leave one out")
        assemblies[short] = declare(read)
    tables = deck.tables.get("axes")
    if not isinstance(tables, list) or not tables:
        raise DeckError(
            deck.place("axes"), "no axes are given",
            next_step='write [[axes]] and then GridAxis = {name = "...", lower = 1, upper = 2, count = 5}',
        )  # fmt: skip
    axes = [_beside(_axes(deck, number, given), file.parent) for number, given in enumerate(tables, start=1)]
    question = _question(deck)
    task = sweep_task(assemblies, axes=axes, ask=question)
    try:
        require_askable(task)
    except NlsError as error:
        raise error.at(deck.place(f"ask.{type(question).__name__}")) from None
    return task


def _axes(deck: Deck, number: int, given: Any) -> AxisSet:
    place = deck.place(f"axes[{number}]")
    if not isinstance(given, Mapping) or len(given) != 1:
        raise DeckError(place, "must hold one set of axes", next_step=f"write one of: {', '.join(_AXES)}")
    ((name, fields),) = given.items()
    if name not in _AXES:
        raise unknown_name(place, name, _AXES)
    made: AxisSet = _made(deck, _AXES[name], fields, f"axes[{number}].{name}")
    return made


def _made(deck: Deck, kind: type, fields: Any, path: str) -> Any:
    """Return an object of a table whose values are checked where they are used."""
    place = deck.place(path)
    if not isinstance(fields, Mapping):
        raise DeckError(place, f"{brief(fields)} is not a table", next_step="write {field = ..., ...}")
    known = {field.name: field for field in dataclasses.fields(kind)}
    for field in fields:
        if field not in known:
            raise unknown_name(f"{deck.place(f'{path}.{field}')}: field", field, known)
    missing = [n for n, f in known.items() if n not in fields and f.default is dataclasses.MISSING]
    if missing:
        raise DeckError(place, f"{kind.__name__} lacks {', '.join(missing)}",
                        next_step=f"fields are: {', '.join(known)}")  # fmt: skip
    values = {name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()}
    try:
        return kind(**values)
    except NlsError as error:
        raise error.at(place) from None


def _question(deck: Deck) -> SweepQuestion:
    given = deck.tables.get("ask")
    if not isinstance(given, Mapping) or len(given) != 1:
        raise DeckError(
            deck.place("ask"), "must hold one question",
            next_step=f"write [ask.NAME], one of: {', '.join(_QUESTIONS)}",
        )  # fmt: skip
    ((name, fields),) = given.items()
    if name not in _QUESTIONS:
        raise unknown_name(deck.place(f"ask.{name}"), name, _QUESTIONS)
    path = f"ask.{name}"
    if name == DesignQuestion.__name__:
        prefix = f"ask.{DesignQuestion.__name__}"
        if not isinstance(fields, Mapping):
            raise DeckError(deck.place(prefix), "is no table", next_step=f"write [{prefix}]")
        job = job_in(Deck(deck.name, "", deck.path, fields, deck.places, stands_in=prefix))
        if not isinstance(job.target, Target) or any(not isinstance(each, str) for each in job.free or ()):
            raise DeckError(
                deck.place(prefix), "has a stock, or a task in place of a target",
                next_step="make the stock an axis (Listed), and the curve for the task a file",
            )  # fmt: skip
        search = fields.get("search", {})
        settings = dataclasses.replace(
            QUICK, seed=job.settings.seed, largest_error=job.settings.largest_error,
            starts=job.settings.starts if "starts" in search else QUICK.starts,
        )  # fmt: skip
        free = None if job.free is None else tuple(str(each) for each in job.free)
        return DesignQuestion(job.target, free, job.keep, job.goals, job.spring or "", settings)
    if isinstance(fields, Mapping) and "gains" in fields and name == LoopQuestion.__name__:
        fields = {**fields, "gains": built(deck, TorqueGains, fields["gains"], deck.place(f"{path}.gains"))}
    made: SweepQuestion = _made(deck, _QUESTIONS[name], _in_si(deck, _QUESTIONS[name], fields), path)
    if isinstance(made, DiagnosisQuestion):
        made = dataclasses.replace(made, records=_folder(made.records, deck.path.parent))
    return made


def _folder(name: str, beside: Path) -> str:
    """Return a folder of records that stands beside the sweep file in full, so that workers find it."""
    return str((beside / name).resolve() if (beside / name).is_dir() else name)


def _beside(axes: AxisSet, folder: Path) -> AxisSet:
    """Return a list of folders of records in full; any other set of axes as it is."""
    if not isinstance(axes, Listed) or not isinstance(axes.values, Mapping) or RECORDS not in axes.values:
        return axes
    given = axes.values[RECORDS]
    if isinstance(given, str):  # refused as the row of one name
        return axes
    return Listed({**axes.values, RECORDS: [_folder(str(each), folder) for each in given]})


def _in_si(deck: Deck, kind: type, fields: Any) -> Any:
    """Return the fields of a question with numbers in SI, each of the kind of its default."""
    if not isinstance(fields, Mapping):
        return fields
    defaults = {field.name: field.default for field in dataclasses.fields(kind)}
    units = {field.name: unit_of_field(field) for field in dataclasses.fields(kind)}
    values: dict[str, Any] = {}
    for name, value in fields.items():
        default, new, place = defaults.get(name), value, deck.place(f"ask.{kind.__name__}.{name}")
        if isinstance(default, float) and isinstance(value, str):
            try:
                number, unit = split_number(value)
                new = number * parse_unit(unit or "1").factor
                if unit and not same_dimension(unit, units[name] or "1"):
                    raise UnitError(value, f"'{unit}' is no unit of it",
                                    next_step=f"give it in a unit like '{units[name] or '1'}'")  # fmt: skip
            except NlsError as error:
                raise error.at(place) from None
        elif isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
            new = float(value)
        if isinstance(default, bool | int | float | str) and not isinstance(new, type(default)):
            raise DeckError(place, f"{brief(value)} is not of the kind of {default!r}")
        values[name] = new
    return values
