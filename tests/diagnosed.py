"""Sets of records of the independent rig, with the deck that its makers declare, and their diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from models.test_rig import test_rig_deck
from nlsdesign.bench.discrepancy import Verdict, diagnose
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.components import Assembly, InextensibleCable
from nlsdesign.model import flatten
from tests.rig import ACTUATORS, make_records, write_set
from tests.rig.records import RECORDS

declared_rig = test_rig_deck


def rig_set(
    folder: Path, actuator: str, effects: Mapping[str, float], seed: int, *, only: Sequence[str] = RECORDS
) -> tuple[Assembly, RecordSet]:
    """Write a set, or only some of its records, as a bench leaves it, and read it back as a user would."""
    write_set(folder, ACTUATORS[actuator], make_records(ACTUATORS[actuator], effects, seed, only=only))
    declared = declared_rig(folder / "rig.toml", folder / "cam.csv")
    return declared, load_records(folder, flatten(declared))


def with_true_contact(declared: Assembly) -> Assembly:
    """Return the rig with rubber that is on its own while its cable is slack, which is not how it buckles."""
    members = declared.element("spring.cable").children()
    return declared.with_part("spring.cable", InextensibleCable(members=tuple(members.items())))


def verdict_of(folder: Path, actuator: str, effects: Mapping[str, float], seed: int) -> Verdict:
    return diagnose(*rig_set(folder, actuator, effects, seed))


def names(verdict: Verdict) -> list[str]:
    return [effect.name for effect in verdict.effects]
