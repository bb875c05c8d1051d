"""Anybody's answers to a data set of hidden effects, read with care and turned into results of the score."""

from __future__ import annotations

import difflib
import json
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from benchmarks._effects_data import FORMAT, known_names
from benchmarks._score_cases import Case
from benchmarks._score_kinds import named_with_place
from benchmarks._score_table import Result
from benchmarks._score_truth import INTERVAL

Fields = Mapping[str, Any]


class AnswerError(Exception):
    """What is wrong with a file, in one sentence."""


def results_of(answers: Path, truth: Path) -> tuple[str, list[Result]]:
    """Return the name of the method and one result for each case of the data set.

    Parameters
    ----------
    answers
        JSON as the README of the data set describes it.
    truth
        ``truth.json`` of the data set.
    """
    given, labels = _read(answers), _read(truth)["cases"]
    cases = given["cases"]
    for name in cases:
        if name not in labels:
            raise AnswerError(f"{answers}: there is no case '{name}' in {truth}")
    absent: Fields = {"failed": "no answer"}
    results = [
        _result(label, cases.get(name, absent), f"{answers}, {name}") | {"case": name}
        for name, label in labels.items()
    ]
    return str(given.get("method", answers.stem)), results


def _read(file: Path) -> dict[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise AnswerError(f"{file} cannot be read: {error}") from error
    if not isinstance(content, dict) or not isinstance(content.get("cases"), dict):
        raise AnswerError(f"{file}: there is no table 'cases'")
    if content.get("format") != FORMAT:
        raise AnswerError(f"{file}: the format is {content.get('format')!r}, this command reads {FORMAT}")
    return content


def _result(label: Fields, answer: object, where: str) -> Result:
    """Return the result of one case, as a run of the score writes it."""
    if not isinstance(answer, dict):
        raise AnswerError(f"{where}: an answer is a table")
    case = Case(
        label["tier"], label["kind"], tuple(label["hidden"]), label["strength"], label["seed"],
        label["condition"],
    )  # fmt: skip
    result: Result = {
        "tier": case.tier, "machine": case.machine, "hidden": label["hidden"], "strength": case.strength,
        "seed": case.seed, "cpu_seconds": _number(answer.get("seconds", math.nan), f"{where}, seconds"),
    }  # fmt: skip
    if "failed" in answer:
        return result | {"error": str(answer["failed"])}
    effects = [_effect(each, f"{where}, effects") for each in _list(answer.get("effects", []), where)]
    named = [named_with_place(case, e["name"], str(e.get("part", ""))) for e in effects]
    return result | {
        "named": named,
        "probabilities": [e.get("probability") for e in effects],
        "verdict": "named" if named else "unknown" if answer.get("unknown") else "none",
        "covered": _covered(label, effects, answer.get("numbers", {}), where),
    }


def _effect(given: object, where: str) -> dict[str, Any]:
    if not isinstance(given, dict) or not isinstance(given.get("name"), str):
        raise AnswerError(f"{where}: an effect is a table with a name")
    if given["name"] not in known_names():
        near = difflib.get_close_matches(given["name"], known_names(), 1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        raise AnswerError(f"{where}: '{given['name']}' is no name of the data set{hint}")
    probability = given.get("probability")
    if probability is not None and not 0.0 <= _number(probability, where) <= 1.0:
        raise AnswerError(f"{where}: a probability lies between 0 and 1, not {probability}")
    return given


def _covered(label: Fields, effects: list[dict[str, Any]], numbers: object, where: str) -> Fields:
    """Return for each stated number whose truth is known: value, standard error, truth, whether inside."""
    rows: dict[str, list[float | bool]] = {}
    stated = [
        (f"{e['name']}.{name.rpartition('.')[2]}", pair, label["sizes"])
        for e in effects
        for name, pair in _table(e.get("numbers", {}), where).items()
    ]
    stated += [(name, pair, label["numbers"]) for name, pair in _table(numbers, where).items()]
    for name, pair, truths in stated:
        values = _list(pair, f"{where}, {name}")
        if len(values) != 2:
            raise AnswerError(f"{where}, {name}: a number is [value, standard error]")
        if None in values:
            continue
        value, error = (_number(each, f"{where}, {name}") for each in values)
        if name in truths:
            rows[name] = [value, error, truths[name], abs(value - truths[name]) <= INTERVAL * error]
    return rows


def _number(given: object, where: str) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise AnswerError(f"{where}: {given!r} is no number")
    return float(given)


def _list(given: object, where: str) -> list[Any]:
    if not isinstance(given, list):
        raise AnswerError(f"{where}: {given!r} is no list")
    return given


def _table(given: object, where: str) -> dict[str, Any]:
    if not isinstance(given, dict):
        raise AnswerError(f"{where}: {given!r} is no table")
    return given


def answers_of(method: Callable[[Path], Fields], name: str, folder: Path) -> dict[str, Any]:
    """Return the answers of a method to all cases of a data set; it sees one folder at a time.

    Parameters
    ----------
    method
        From the folder of a case to its answer, without ``seconds``.
    name
        Of the method, with its version.
    folder
        Of the data set.
    """
    cases: dict[str, Any] = {}
    for place in sorted(folder.glob("case_*")):
        begin = _worked()
        try:
            answer = dict(method(place))
        except Exception as error:
            answer = {"failed": f"{type(error).__name__}: {error}"}
        cases[place.name] = answer | {"seconds": round(_worked() - begin, 2)}
        said = [e["name"] for e in answer.get("effects", [])] or [
            "unknown" if answer.get("unknown") else "none"
        ]
        print(
            f"{place.name}: {answer.get('failed') or '+'.join(said)} ({cases[place.name]['seconds']} s)",
            flush=True,
        )
    return {"format": FORMAT, "method": name, "cases": cases}


def _worked() -> float:
    """Return the processor time of this process and of those that it has waited for."""
    return sum(os.times()[:4])
