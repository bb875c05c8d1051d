"""A data set of records with hidden effects, a score for anybody's answers, and some methods that answer it.

    python -m benchmarks.hidden_effects write FOLDER --seeds 1300:1302
    python -m benchmarks.hidden_effects answer FOLDER --method sparse_regression --out sparse_regression.json
    python -m benchmarks.hidden_effects score diagnosis.json sparse_regression.json --truth FOLDER/truth.json
    python -m benchmarks.hidden_effects score *.json --truth FOLDER/truth.json --table docs/others_methods.md

The README in the folder says what the records are and how answers are written. Cases and definitions of the
score are those of ``docs/scores.md``. Methods are the modules of ``benchmarks.methods``.
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
import pkgutil
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks import methods
from benchmarks._effects_answers import AnswerError, answers_of, results_of
from benchmarks._effects_data import KINDS, TIERS, write_data_set
from benchmarks._effects_table import page
from benchmarks.discrepancy_score import seeds_of
from nlsdesign.foundation.text_files import write_text
from tests.rig.kind_cases import ALL_KINDS

MARK = "<!-- written by benchmarks.hidden_effects from here on -->"


def main(arguments: Sequence[str] | None = None) -> int:
    """Do what the first word says; return the exit status."""
    given = _parser().parse_args(arguments)
    try:
        given.act(given)
    except AnswerError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.hidden_effects", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    acts = parser.add_subparsers(required=True)
    write = acts.add_parser("write", help="write the data set")
    write.add_argument("folder", type=Path)
    write.add_argument("--seeds", required=True, help="such as 1300:1302, which is without 1302")
    write.add_argument("--kinds", default=",".join(KINDS), help=f"with commas, of {', '.join(ALL_KINDS)}")
    write.add_argument("--tiers", default="clean,single,half", help=f"with commas, of {', '.join(TIERS)}")
    write.set_defaults(act=_write)
    answer = acts.add_parser("answer", help="let a method answer")
    answer.add_argument("folder", type=Path)
    names = sorted(module.name for module in pkgutil.iter_modules(methods.__path__) if module.name[0] != "_")
    answer.add_argument("--method", choices=names, required=True)
    answer.add_argument("--out", type=Path, required=True, help="answers, JSON")
    answer.set_defaults(act=_answer)
    score = acts.add_parser("score", help="score answers")
    score.add_argument("answers", type=Path, nargs="+")
    score.add_argument("--truth", type=Path, required=True)
    score.add_argument("--table", type=Path, help="Markdown file for the table; its head is kept")
    score.set_defaults(act=_score)
    return parser


def _write(given: argparse.Namespace) -> None:
    kinds, tiers = _some(given.kinds, ALL_KINDS, "kind"), _some(given.tiers, TIERS, "tier")
    try:
        seeds = seeds_of(given.seeds)
    except ValueError:
        raise AnswerError(f"'{given.seeds}' are no seeds: write 1300:1302 or 1300,1305") from None
    more = f" --kinds {','.join(kinds)} --tiers {','.join(tiers)}"
    command = f"python -m benchmarks.hidden_effects write FOLDER --seeds {given.seeds}{more}"
    count = write_data_set(given.folder, seeds, kinds, tiers, command)
    print(f"{count} cases in {given.folder}; labels are in truth.json")


def _some(text: str, known: Sequence[str] | dict[str, str], what: str) -> list[str]:
    names = text.split(",")
    for name in names:
        if name not in known:
            raise AnswerError(f"there is no {what} '{name}'; there are {', '.join(known)}")
    return names


def _answer(given: argparse.Namespace) -> None:
    method = importlib.import_module(f"benchmarks.methods.{given.method}")
    answers = answers_of(method.answer, method.NAME, given.folder)
    if not answers["cases"]:
        raise AnswerError(f"{given.folder} holds no folder case_…")
    write_text(given.out, json.dumps(_finite(answers), indent=1) + "\n")


def _finite(content: object) -> object:
    """Return the content without numbers that JSON does not have."""
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def _score(given: argparse.Namespace) -> None:
    scored = dict(results_of(each, given.truth) for each in given.answers)
    command = json.loads(given.truth.read_text(encoding="utf-8")).get("command", "")
    text = page(scored, command)
    if given.table:
        head = given.table.read_text(encoding="utf-8").partition(MARK)[0] if given.table.exists() else ""
        write_text(given.table, f"{head.rstrip()}\n\n{MARK}\n\n{text}" if head else f"{MARK}\n\n{text}")
    print(text)


if __name__ == "__main__":
    sys.exit(main())
