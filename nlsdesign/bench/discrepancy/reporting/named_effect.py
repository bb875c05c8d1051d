"""In words: an effect that was added with what speaks for it, and records that are suspect."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, TypeAlias

from ....components.assembly.named_parts import Assembly
from ....foundation.quantity import significant, three_digits, to_resolution, with_error, with_unit
from ..effects.plain_names import capitalised, effect_in_words, title

_CLEAR = 2.0
"""A loss of prediction below so many standard errors is told as uncertain."""


@dataclass(frozen=True)
class EffectEvidence:
    """What speaks for an effect, on records that its numbers were not fitted to."""

    # removal_cost, removal_error: predictive log density that is lost without the effect, and its standard
    # error
    removal_cost: float
    removal_error: float
    # number, distance: the number that says how large the effect is, and how many standard errors it is away
    # from the value at which the effect vanishes
    number: str = ""
    distance: float = math.nan
    # worst_record, worst_change: the record that gains least, and the gain of its log-likelihood; below zero
    # it becomes worse
    worst_record: str = ""
    worst_change: float = math.nan
    # over_simpler: the simpler forms of the effect: identifier, log-likelihood that is lost with that form in
    # its place, and its standard error
    over_simpler: tuple[tuple[str, float, float], ...] = ()
    # next_leaves, next_name: how many times as much of the excess the best other name leaves, with the noise
    # margin on both sides, and its identifier
    next_leaves: float = math.nan
    next_name: str = ""

    def words(self) -> str:
        """Return the evidence in sentences."""
        text = (
            "Without it records that its numbers were not fitted to are predicted worse: their "
            f"log-likelihood falls by {with_error(self.removal_cost, self.removal_error)}."
        )
        if math.isfinite(self.distance):
            text += f" Its `{self.number}` is {self.distance:.3g} standard errors away from no effect."
        if self.worst_record:
            change = three_digits(abs(self.worst_change))
            text += f" The record that gains least is '{self.worst_record}': there it "
            text += f"falls by {change}." if self.worst_change >= 0.0 else f"rises by {change}."
        if math.isfinite(self.next_leaves):
            other = f", {title(self.next_name)}," if self.next_name else ""
            text += f" The best other name{other} leaves {three_digits(self.next_leaves)} times as much."
        return " ".join([text, *(self._over(*each) for each in self.over_simpler)])

    def _over(self, simpler: str, cost: float, error: float) -> str:
        text = f"With {title(simpler)}, its simpler form, in its place it falls by {with_error(cost, error)}"
        if cost > _CLEAR * error:
            return f"{text}: that is why the richer form is named."
        return f"{text}, which is little more than its error."


Numbers: TypeAlias = Mapping[str, tuple[float, str, float]]
"""Value, unit and standard error by full name."""


def numbers_in_words(numbers: Numbers) -> str:
    """Return numbers with their standard errors and units."""
    return ", ".join(
        f"{name.rpartition('.')[2].replace('_', ' ')} = {with_unit(with_error(value, error), unit)}"
        for name, (value, unit, error) in numbers.items()
    )


def listed_numbers(numbers: Numbers) -> list[dict[str, Any]]:
    """Return numbers for ``verdict.json``."""
    return [
        {"name": n, "value": to_resolution(v, s), "unit": u, "standard_error": significant([s], 4)[0]}
        for n, (v, u, s) in numbers.items()
    ]


@dataclass(frozen=True)
class NamedEffect:
    """An effect that was added."""

    # name, location: identifier of the catalogue, and the path of the part
    name: str
    location: str
    parameters: Numbers  # value, unit and standard error by full name
    aliases: tuple[str, ...]  # effects of the catalogue that explain the records as well
    share: float  # share of the excess over the noise, left when it was added, that it explains in prediction
    # signature, source: what it leaves in records, and where its law comes from
    signature: str
    source: str
    probability: float = math.nan  # that the effect is there; not a number where none was worked out
    evidence: EffectEvidence | None = None  # what speaks for it, in numbers

    def headline(self, assembly: Assembly) -> str:
        """Return effect and place in words, such as ``second relaxation in the rubber``."""
        return effect_in_words(assembly, self.name, self.location)

    def numbers_in_words(self) -> str:
        """Return its numbers with their standard errors and units."""
        return numbers_in_words(self.parameters)

    def words(self, assembly: Assembly) -> str:
        """Return what it is, how large, and what speaks for it."""
        text = f"{capitalised(self.headline(assembly))} (`{self.name}` at `{self.location}`)"
        text += f": {self.numbers_in_words()}." if self.parameters else "."
        if math.isfinite(self.probability):
            text += f" Probability {self.probability:.3g}."
        if self.signature:
            text += f" What it leaves in records: {self.signature}."
        if math.isfinite(self.share):
            text += f" It explains {100 * self.share:.0f} % of the excess over the noise that was left."
        if self.evidence is not None:
            text += f" {self.evidence.words()}"
        if self.aliases:
            text += f" These records do not tell it from: {', '.join(title(a) for a in self.aliases)}."
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return it for ``verdict.json``."""
        evidence = {} if self.evidence is None else asdict(self.evidence)
        return {
            "name": self.name,
            "location": self.location,
            "probability": self.probability,
            "parameters": listed_numbers(self.parameters),
            "aliases": list(self.aliases),
            "evidence": {
                "share": self.share,
                "signature": self.signature,
                **evidence,
            },
        }


LET_GO = (
    "Deck and records contradict each other",
    "With declared numbers let go the model explains the records better, so no effect is named; look at "
    "these numbers first, and whether the records are of this rig.",
)
"""Headline and explanation where other numbers explain the records: then these need not be suspect."""
STRAINED = "declared numbers are probably wrong"
"""Begins the reason where a refit leaves nothing, but lies far from what is declared."""
CONTRADICTION = "deck and records contradict each other, so nothing is named"
"""Why an effect that explains much is not named all the same."""


def as_sentence(text: str) -> str:
    """Return a reason as a sentence or a question; the name of a file at its beginning stays as it is."""
    begins = text.split(maxsplit=1)[0].isalpha()
    sentence = (capitalised(text) if begins else text).rstrip(".")
    return sentence if sentence.endswith("?") else f"{sentence}."
