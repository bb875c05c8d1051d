"""The fuzzers with a fixed seed and small counts; ``python -m tests.fuzz`` runs them by the thousand."""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pytest

from nlsdesign.foundation.errors import NlsError
from tests.fuzz import family_names
from tests.fuzz.cases import ACCEPTED, REFUSED, Case, Family, Outcome
from tests.fuzz.commands import Commands
from tests.fuzz.decks import Decks
from tests.fuzz.fmus import Fmus
from tests.fuzz.interrupts import Interrupts
from tests.fuzz.records import Records
from tests.fuzz.running import made_by, outcome_of, outcomes, shrunk

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="workers are forked, and limits are those of Linux"
)


def faults(family: Family, numbers: range, seed: int = 7) -> list[tuple[int, Outcome]]:
    return [pair for pair in outcomes(family, made_by(family, seed), numbers) if pair[1].wrong]


def test_mutated_decks_are_refused_clearly_or_read_back_the_same() -> None:
    assert faults(Decks(), range(42)) == []


def test_mutated_records_and_other_files_are_refused_clearly_or_read() -> None:
    records = Records()
    assert [outcome_of(records, case).kind for case in records.undamaged()] == [ACCEPTED] * len(
        records.undamaged()
    )
    assert faults(records, range(60)) == []


def test_mutated_fmus_are_refused_clearly_and_leave_nothing() -> None:
    fmus = Fmus(models=("controller",), versions=("3.0",))
    (sound,) = fmus.undamaged()
    assert outcome_of(fmus, sound) == Outcome(ACCEPTED)
    assert faults(fmus, range(12)) == []


def test_odd_command_lines_end_without_traceback() -> None:
    assert faults(Commands(), range(12), seed=6) == []


def test_an_interrupted_command_ends_at_once_and_leaves_nothing() -> None:
    family = Interrupts(fmu=False)
    early, late = (
        Case(family.files, ("simulate", after, kind))
        for after, kind in (("0.05", "SIGTERM"), ("0.6", "SIGINT"))
    )
    assert [outcome_of(family, case) for case in (early, late)] == [Outcome(REFUSED)] * 2


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in family_names() if name != "interrupts"])
def test_more_of_each(name: str) -> None:
    from tests.fuzz import family_of

    assert faults(family_of(name), range(1000, 1200), seed=11) == []


# --- the fuzzer itself -----------------------------------------------------------------------------


class Brittle:
    """A family whose cases end in each of the ways in which one may."""

    limit = 0.5

    def made(self, random: random.Random, number: int) -> Case:
        return Case({"one.toml": b"a\nb\nc\nboom\nd\n"}, (str(number % 6),))

    def judged(self, case: Case, folder: Path) -> Outcome:
        kind = case.words[0]
        if kind == "0" and b"boom" in (folder / "one.toml").read_bytes():
            raise ZeroDivisionError
        if kind == "1":
            raise NlsError("thing", "rule")
        if kind == "2":
            import time

            time.sleep(60.0)
        if kind == "3":
            import os
            import signal

            os.kill(os.getpid(), signal.SIGKILL)
        if kind == "4":
            return Outcome("read back differently")
        return Outcome(ACCEPTED)


def test_every_way_to_end_is_seen_and_the_run_goes_on() -> None:
    kinds = [outcome.kind for _, outcome in outcomes(Brittle(), made_by(Brittle(), 1), range(7))]
    assert kinds == [
        "traceback",
        REFUSED,
        "too long",
        "crashed",
        "read back differently",
        ACCEPTED,
        "traceback",
    ]


def test_a_case_is_made_smaller_as_long_as_it_fails_alike() -> None:
    family = Brittle()
    case = made_by(family, 1)(0)
    assert shrunk(family, case, outcome_of(family, case)).files == {"one.toml": b"boom\n"}
