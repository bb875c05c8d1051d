"""The verdict of a diagnosis with its evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar

from ..errors import unknown_name
from .sections import PagePosition, Section

VERDICTS = {
    "none": "nothing is missing",
    "named": "effect named",
    "unknown": "an effect without a name",
    "data_suspect": "the data are suspect",
}


@dataclass(frozen=True, eq=False)
class VerdictSection(Section):
    """A verdict with its evidence: tables of candidates, figures of the errors.

    Parameters
    ----------
    verdict
        ``"none"``, ``"named"``, ``"unknown"`` or ``"data_suspect"``.
    words
        The findings, in sentences.
    parts
        Sections with the evidence.

    Raises
    ------
    UnknownNameError
        If there is no such verdict.
    """

    verdict: str
    words: str
    _: KW_ONLY
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
        return {"verdict": self.verdict, "badge": VERDICTS[self.verdict], "words": self.words, "parts": parts}
