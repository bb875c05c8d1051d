"""Columns of a sweep: what was chosen, what was answered, how each point went."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

DONE: Final = "done"
FAILED: Final = "failed"
RESULTS_FILE: Final = "results.parquet"
SALTELLI: Final = "saltelli"
"""Kind of the axes of a Saltelli plan."""
Role = Literal["axis", "answer", "state"]


@dataclass(frozen=True)
class SweepColumn:
    """One column of a sweep.

    Parameters
    ----------
    name
        For an axis the full name of the number in the deck, or what else it changes.
    unit
        In SI; empty for words and counts.
    description
        A few words.
    role
        Whether it was chosen (``"axis"``), answered, or says how the point went (``"state"``).
    kind
        Of an axis: ``"grid"``, ``"sobol"``, ``"latin_hypercube"``, ``"list"``, ``"random"`` or that of a plan
        of one's own; else empty.
    lower, upper
        Range of an axis of numbers, in SI; ``None`` for one of words, and for answers and states.
    """

    name: str
    unit: str
    description: str
    role: Role
    kind: str = ""
    lower: float | None = None
    upper: float | None = None


STATE_COLUMNS: Final = (
    SweepColumn("point", "", "number of the point, from 0", "state"),
    SweepColumn("status", "", "done or failed", "state"),
    SweepColumn("reason", "", "why the point failed", "state"),
)
