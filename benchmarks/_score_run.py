"""One case: make records, let the diagnosis decide on the files alone, then compare with what was hidden."""

from __future__ import annotations

import os
import signal
import tempfile
import time
import traceback
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from types import FrameType
from typing import Any

from benchmarks._score_cases import NOISES, Case
from benchmarks._score_digest import digest
from benchmarks._score_kinds import named_with_place
from benchmarks._score_truth import covered, true_numbers
from benchmarks._score_yardsticks import YARDSTICKS, MissingError, table_of
from models.test_rig import test_rig_deck
from nlsdesign.bench.discrepancy import Verdict, diagnose
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from tests.rig import ACTUATORS, THREE_RECORDS, make_records, mistaken, write_set
from tests.rig.commands import RECORDS
from tests.rig.kind_cases import ALL_KINDS, write_kind_case
from tests.rig.machines import MACHINES, write_machine_set
from tests.rig.records import stream_of_mistakes

SAYS_HELD = find_spec("nlsdesign.bench.identification.records.sampling") is not None
"""Whether `records.toml` can say that a current is held; every other seed says it then."""


class TooLongError(Exception):
    """A case took longer than it may."""


def run(case: Case, limit: int = 0, yardsticks: bool = False) -> dict[str, Any]:
    """Return the result of one case; one that fails gives the reason.

    Parameters
    ----------
    case
        What to hide.
    limit
        Seconds of the processor after which it is given up; 0 for never.
    yardsticks
        Whether the yardsticks decide on the same records.
    """
    result: dict[str, Any] = {
        "case": case.name, "tier": case.tier, "machine": case.machine, "hidden": list(case.effects),
        "strength": case.strength, "seed": case.seed, "noise": case.noise,
        "code": digest(),
    }  # fmt: skip
    if limit:
        signal.signal(signal.SIGPROF, _give_up)
        signal.setitimer(signal.ITIMER_PROF, limit)
    begin, worked = time.perf_counter(), _worked()
    try:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            if wrong := write_case(folder, case):
                result["wrong"] = wrong
            begin, worked = time.perf_counter(), _worked()
            declared, records = opened(folder)
            verdict = diagnose(declared, records)
            result["seconds"] = time.perf_counter() - begin
            result["cpu_seconds"] = _worked() - worked
            result |= content(verdict)
            result["named"] = [named_with_place(case, e.name, e.location) for e in verdict.effects]
            result["covered"] = covered(verdict, true_numbers(case))
            result["yardsticks"] = _yardsticks(declared, records) if yardsticks else {}
    except Exception as error:
        result["seconds"] = time.perf_counter() - begin
        result["cpu_seconds"] = _worked() - worked
        result["error"] = f"{type(error).__name__}: {error}"
        result["trace"] = traceback.format_exc(limit=-4)
    finally:
        if limit:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
    return result


def write_case(folder: Path, case: Case) -> str:
    """Write the files that a bench would leave, and return which declared number is wrong, if any.

    Parameters
    ----------
    folder
        Becomes the set of records with its declaration.
    case
        What to hide.
    """
    if case.machine in ALL_KINDS:
        says_held = SAYS_HELD and case.seed % 2 == 1
        write_kind_case(
            folder, case.machine, case.effects, case.strength, case.seed,
            condition=case.noise, says_held=says_held,
        )  # fmt: skip
        return ""
    conditions = NOISES[case.noise]
    if case.machine in MACHINES:
        write_machine_set(folder, MACHINES[case.machine], case.hidden, case.seed, conditions=conditions)
        return ""
    actuator, wrong = ACTUATORS[case.machine], ""
    only = THREE_RECORDS if case.tier == "three records" else RECORDS
    records = make_records(actuator, case.hidden, case.seed, only=only, conditions=conditions)
    if case.tier == "wrong number":
        actuator, wrong = mistaken(actuator, stream_of_mistakes(case.seed))
    write_set(folder, conditions.declared(actuator), records)
    return wrong


def opened(folder: Path) -> tuple[Assembly, RecordSet]:
    """Return what a folder declares and the records in it; that is all that a method gets to see.

    Parameters
    ----------
    folder
        With ``rig.toml`` and ``cam.csv``, or with ``deck.toml``, and the records.
    """
    deck = folder / "deck.toml"
    if deck.exists():
        declared = declare(load_deck(deck))
    else:
        declared = test_rig_deck(folder / "rig.toml", folder / "cam.csv")
    return declared, load_records(folder, flatten(declared))


def content(verdict: Verdict) -> dict[str, Any]:
    """Return what a verdict says, as far as it says it.

    Parameters
    ----------
    verdict
        Of one case.
    """
    remainder = getattr(verdict, "remainder", None)
    return {
        "verdict": verdict.verdict,
        "complete": getattr(verdict, "complete", None),
        "remainder": None if remainder is None else str(getattr(remainder, "block", "somewhere")),
        "named": [effect.name for effect in verdict.effects],
        "probabilities": [getattr(effect, "probability", None) for effect in verdict.effects],
        "next_leaves": [effect.evidence.next_leaves for effect in verdict.effects if effect.evidence],
        "aliases": [list(effect.aliases) for effect in verdict.effects],
        "closed": verdict.closed,
        "ratio": verdict.held_out_ratio,
        "before": verdict.rms("before", "held_out") / verdict.rms("noise_floor", "held_out"),
        "where": list(verdict.where),
        "runners_up": [[name, round(share, 3), *why] for name, share, *why in verdict.runners_up],
    }


def _worked() -> float:
    """Return the processor time of this process and of those that it has waited for."""
    return sum(os.times()[:4])


def _give_up(number: int, frame: FrameType | None) -> None:
    raise TooLongError("longer than the limit")


def _yardsticks(declared: Assembly, records: RecordSet) -> Mapping[str, list[str] | str]:
    names: dict[str, list[str] | str] = {}
    table = table_of(declared, records)
    for name, decide in YARDSTICKS.items():
        try:
            names[name] = decide(table)
        except MissingError as error:
            names[name] = f"skipped: {error}"
    return names
