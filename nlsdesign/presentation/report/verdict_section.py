"""The verdict of a diagnosis with its evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar

from ...bench.discrepancy.reporting.verdict import Gap
from ...foundation.errors import unknown_name
from .sections import PagePosition, Section

VERDICTS = {
    "none": "nothing is missing",
    "named": "effect named",
    "unknown": "an effect without a name",
    "undecidable": "the records cannot tell",
    "data_suspect": "data or deck are suspect",
}

_WIDTH = 100.0
"""Width of the longer bar of the gap, in units of the drawing."""


@dataclass(frozen=True, eq=False)
class VerdictSection(Section):
    """A verdict with its evidence: tables of candidates, figures of the errors.

    Parameters
    ----------
    verdict
        ``"none"``, ``"named"``, ``"unknown"``, ``"undecidable"`` or ``"data_suspect"``.
    words
        The findings, in sentences.
    headline
        The findings in one line.
    gap
        Error before and after; ``None`` where there is none to show.
    after
        How the model after differs from the one before.
    parts
        Sections with the evidence.
    """

    verdict: str
    words: str
    _: KW_ONLY
    headline: str = ""
    gap: Gap | None = None
    after: str = "with what was added"
    parts: tuple[Section, ...] = ()
    template: ClassVar[str] = "verdict.html"

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise unknown_name("verdict", self.verdict, VERDICTS)

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return the verdict and the contents of its parts."""
        parts = [
            {
                "title": part.title,
                "template": part.template,
                "key": place.inner(i).key,
                **part.content(place.inner(i)),
            }
            for i, part in enumerate(self.parts, start=1)
        ]
        return {
            "verdict": self.verdict,
            "badge": VERDICTS[self.verdict],
            "headline": self.headline,
            "gap": None if self.gap is None else _drawn(self.gap, self.after),
            "words": self.words,
            "parts": parts,
        }


def _drawn(gap: Gap, after: str) -> Mapping[str, Any]:
    """Return the two bars of a gap and the numbers below them."""
    longest = max(gap.before, gap.after) or 1.0
    bars = {n: f"{_WIDTH * getattr(gap, n) / longest:.2f}" for n in ("before", "after")}
    records = "records that no fit has seen" if gap.role == "held_out" else "the fitted records"
    note = (
        f"before, the refitted declared model; after, {after}. Both filtered alike."
        if gap.changed
        else "the refitted declared model; nothing was added."
    )
    note = f"Root mean square error of `{gap.block}` on {records}: {note}"
    return {"bars": bars if gap.changed else None, "rows": gap.rows(), "note": note, "words": gap.words()}
