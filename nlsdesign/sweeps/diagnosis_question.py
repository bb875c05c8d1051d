"""A diagnosis of the records of a folder against the deck of each point."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ..bench.discrepancy import diagnose
from ..bench.discrepancy.effects import catalogue
from ..bench.identification import load_records
from ..components.assembly.named_parts import Assembly
from ..foundation.errors import MeasurementError, unknown_name
from ..model import flatten
from .changes import ASK
from .sweep_columns import SweepColumn
from .sweep_question import SweepQuestion, answer

RECORDS: Final = f"{ASK}.records"
"""Name of the axis that lists folders of records."""
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

    Raises
    ------
    UnknownNameError
        If the catalogue has no effect of a name.
    """

    records: str
    effects: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        known = [each.__name__ for each in catalogue()]
        for name in self._names():
            if name not in known:
                raise unknown_name("effect of the catalogue", name, known)

    def answers(self, assembly: Assembly) -> tuple[SweepColumn, ...]:
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
        named: dict[str, float] = {}
        for each in verdict.effects:  # one effect may be named at several places
            named[each.name] = float(np.fmax(each.probability, named.get(each.name, math.nan)))
        held_out = any(each.role == "held_out" and each.block == verdict.block for each in verdict.gaps)
        values = {f"verdict.{name}": float(verdict.verdict == name) for name in _VERDICTS}
        values |= {
            "named": float(len(verdict.effects)),
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

    def stands_for(self, name: str, text: str) -> str:
        """Return the digest of the records in a folder that an axis lists.

        Parameters
        ----------
        name
            Of the axis.
        text
            The folder.

        Raises
        ------
        MeasurementError
            If there is no such folder.
        """
        return _content(Path(text)) if name == RECORDS else ""


def _content(folder: Path) -> str:
    if not folder.is_dir():
        raise MeasurementError(str(folder), "is no folder", next_step="name the folder of the records")
    digest = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()
