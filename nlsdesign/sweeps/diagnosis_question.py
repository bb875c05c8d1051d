"""A diagnosis of the records of a folder against the deck of each point."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..components.assembly.named_parts import Assembly
from ..discrepancy import diagnose
from ..discrepancy.effects import catalogue
from ..errors import MeasurementError
from ..identification import load_records
from ..model import flatten
from .columns import Column
from .question import SweepQuestion, answer

_VERDICTS = ("none", "named", "unknown", "undecidable", "data_suspect")


@dataclass(frozen=True)
class DiagnosisQuestion(SweepQuestion):
    """What the declared model lacks on a set of records.

    Parameters
    ----------
    records
        Folder of the records; an axis ``ask.records`` lists several, absolute where workers run elsewhere.
    effects
        Names of the catalogue that get a column; all by default.
    """

    records: str
    effects: tuple[str, ...] = ()

    def answers(self, assembly: Assembly) -> tuple[Column, ...]:
        """Return which verdict it is, errors, and of each effect whether it is named and how probable."""
        del assembly
        verdicts = (answer(f"verdict.{name}", "", "1 where that is the verdict") for name in _VERDICTS)
        effects = (
            column
            for name in self._names()
            for column in (
                answer(f"named.{name}", "", "1 where the effect is named"),
                answer(f"probability.{name}", "", "that it is there, where it is named"),
            )
        )
        figures = (
            answer("named", "", "number of effects that are named"),
            answer("held_out_ratio", "", "error on held-out records over the noise floor, after"),
            answer("closed", "", "share of the held-out excess that is gone"),
        )
        return (*verdicts, *figures, *effects)

    def ask(self, assembly: Assembly) -> Mapping[str, float]:
        """Return the verdict in numbers."""
        verdict = diagnose(assembly, load_records(Path(self.records), flatten(assembly)))
        named = {each.name: each.probability for each in verdict.effects}
        held_out = any(gap.role == "held_out" for gap in verdict.gaps)
        values = {f"verdict.{name}": float(verdict.verdict == name) for name in _VERDICTS}
        values |= {
            "named": float(len(named)),
            "held_out_ratio": verdict.held_out_ratio if held_out else math.nan,
            "closed": verdict.closed if held_out else math.nan,
        }
        for name in self._names():
            values[f"named.{name}"] = float(name in named)
            values[f"probability.{name}"] = named.get(name, math.nan)
        return values

    def _names(self) -> tuple[str, ...]:
        # Functions of the catalogue are named as their effects.
        return self.effects or tuple(dict.fromkeys(each.__name__ for each in catalogue()))

    def describe(self) -> str:
        """Return the question with a digest of the records, so that changed records are another question."""
        return f"{super().describe()} {_content(Path(self.records))}"


def _content(folder: Path) -> str:
    if not folder.is_dir():
        raise MeasurementError(str(folder), "is no folder", next_step="name the folder of the records")
    digest = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()
