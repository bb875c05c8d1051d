"""What a diagnosis says, for people and for programs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...components.assembly.named_parts import Assembly
from ...identification.estimation.least_squares import Fit
from ...identification.statistics.residuals import Binned
from ...quantity import significant, to_resolution, with_unit
from ..selection.criteria import Criteria
from ..selection.search import Skipped
from .remainder import Remainder

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NamedEffect:
    """An effect that was added.

    Parameters
    ----------
    name, location
        Identifier of the catalogue, and the path of the part.
    parameters
        Value, unit and standard error by full name.
    aliases
        Effects of the catalogue that explain the records as well.
    share
        Share of the excess over the noise, left when it was added, that it explains in prediction.
    signature, source
        What it leaves in records, and where its law comes from.
    gain, gain_error
        What prediction loses without it, in effective squares of the noise, and the standard error.
    exclusion
        Standard errors by which its numbers exclude no effect.
    """

    name: str
    location: str
    parameters: Mapping[str, tuple[float, str, float]]
    aliases: tuple[str, ...]
    share: float
    signature: str
    source: str
    gain: float = math.nan
    gain_error: float = math.nan
    exclusion: float = math.nan


@dataclass(frozen=True)
class Refused:
    """An effect that was tried and not named.

    Parameters
    ----------
    name, location
        Identifier of the catalogue, and the path of the part.
    share
        Share of the whole excess that it explains alone.
    objections
        Clauses of the rule that speak against it, in words.
    """

    name: str
    location: str
    share: float
    objections: tuple[str, ...]

    def __str__(self) -> str:
        first = f"{self.name} at {self.location} explains {100.0 * max(self.share, 0.0):.0f} % alone"
        return f"{first}, not named: {'; '.join(self.objections)}"


@dataclass(frozen=True)
class RecordGap:
    """Error of one block on one record before and after, in the unit of the block.

    Parameters
    ----------
    block, record, role
        Which.
    before, after, noise_floor
        Root mean square of the filtered error of the refitted declared model, of the model with the effects,
        and of the noise alone.
    rows
        Samples that count.
    unit
        Of the three.
    """

    block: str
    record: str
    role: str
    before: float
    after: float
    noise_floor: float
    rows: int
    unit: str


@dataclass(frozen=True, eq=False)
class Course:
    """One held-out record over time: measured, predicted before and after."""

    record: str
    quantity: str
    unit: str
    time: Array
    measured: Array
    before: Array
    after: Array
    noise: float


@dataclass(frozen=True, eq=False)
class Verdict:
    """The outcome of a diagnosis.

    Parameters
    ----------
    verdict
        ``none``, ``named``, ``unknown`` or ``data_suspect``.
    effects
        In the order in which they were added.
    where
        Findings in words, one per block, and what is odd about the data.
    gaps
        Error of every block on every record.
    block
        The block that was furthest from its noise floor; errors are summed up for it.
    runners_up
        Effect and share of the excess that it would have explained, best first.
    actuator
        The refitted assembly with the effects.
    declared
        The refitted assembly without them.
    course
        A held-out record over time.
    unidentified
        What the records cannot tell, in words.
    shapes
        Residual of the summed-up block before and after, over every measured signal, frequency, time and
        direction.
    fits
        Numbers of the better model with their covariance, one for each group of blocks that share some.
    remainder
        What is left without a name in the block that is furthest from its floor; ``None`` if nothing is.
    next_steps
        What to measure next to tell apart what these records cannot.
    skipped
        Effects that were left out of the comparison, and why: too expensive, or not converged.
    complete
        Whether nothing is left beyond the noise in any block.
    criteria
        Numbers of the decision rule.
    refused
        What explains most without being named, and why.
    """

    verdict: str
    effects: tuple[NamedEffect, ...]
    where: tuple[str, ...]
    gaps: tuple[RecordGap, ...]
    block: str
    runners_up: tuple[tuple[str, float], ...]
    actuator: Assembly
    declared: Assembly
    course: Course
    unidentified: tuple[str, ...] = ()
    shapes: Mapping[str, tuple[Binned, Binned]] = field(default_factory=dict)
    fits: tuple[Fit, ...] = ()
    remainder: Remainder | None = None
    next_steps: tuple[str, ...] = ()
    skipped: tuple[Skipped, ...] = ()
    complete: bool = False
    criteria: Criteria = field(default_factory=Criteria)
    refused: tuple[Refused, ...] = ()

    def rms(self, which: str, role: str) -> float:
        """Return the rms error of the summed-up block over the records of a role.

        Parameters
        ----------
        which
            ``before``, ``after`` or ``noise_floor``.
        role
            ``fit`` or ``held_out``.
        """
        gaps = [g for g in self.gaps if g.block == self.block and g.role == role]
        total = sum(g.rows for g in gaps)
        # An exact sum, so that the order of the records makes no difference.
        squares = math.fsum(getattr(g, which) ** 2 * g.rows for g in gaps)
        return math.sqrt(squares / total) if total else float("nan")

    @property
    def held_out_ratio(self) -> float:
        """Held-out error over the noise floor, after."""
        return self.rms("after", "held_out") / self.rms("noise_floor", "held_out")

    @property
    def closed(self) -> float:
        """Share of the held-out excess (in mean square) that is gone."""
        floor = self.rms("noise_floor", "held_out") ** 2
        before, after = (max(0.0, self.rms(w, "held_out") ** 2 - floor) for w in ("before", "after"))
        return 1.0 - after / before if before > 0.0 else 0.0

    def words(self) -> str:
        """Return the verdict in a few sentences."""
        text = {
            "none": "The refitted model explains the records down to their noise; nothing is missing.",
            "unknown": "Something is missing that no effect of the catalogue explains.",
            "data_suspect": "The records are suspect, so nothing is named; look at the data first.",
            "named": "",
        }[self.verdict]
        if self.verdict == "none" and self.unidentified:
            text += (
                f" They leave {len(self.unidentified)} of its numbers or combinations of them open, so they "
                "would not show all that could be missing."
            )
        for effect in self.effects:
            numbers = ", ".join(
                f"{name.rpartition('.')[2]} = {with_unit(f'{value:.4g} ± {error:.2g}', unit)}"
                for name, (value, unit, error) in effect.parameters.items()
            )
            text += f"`{effect.name}` at `{effect.location}`: {numbers}. "
            text += f"It explains {100 * effect.share:.0f} % "
            text += "of the excess over the noise, as predicted from other records. "
            if effect.aliases:
                text += f"As good an explanation: {', '.join(effect.aliases)}. "
        if self.remainder is not None:
            text = f"{text.strip()} {self.remainder.words()}"
        return text.strip()

    def skipped_words(self) -> tuple[str, ...]:
        """Return a sentence for each effect that was left out of the comparison."""
        return tuple(f"not compared: {each}" for each in self.skipped)

    def to_dict(self, model: str = "model.toml") -> dict[str, Any]:
        """Return the content of ``verdict.json``.

        Parameters
        ----------
        model
            Path of the deck of the better model.
        """
        unit = next(g.unit for g in self.gaps if g.block == self.block)
        return {
            "verdict": self.verdict,
            "complete": self.complete,
            "criteria": self.criteria.described(),
            "effects": [
                {
                    "name": e.name,
                    "location": e.location,
                    "parameters": [
                        {
                            "name": n,
                            "value": to_resolution(v, s),
                            "unit": u,
                            "standard_error": significant([s], 4)[0],
                        }
                        for n, (v, u, s) in e.parameters.items()
                    ],
                    "aliases": list(e.aliases),
                    "evidence": {
                        "share": _six_digits(e.share),
                        "gain": _six_digits(e.gain),
                        "gain_error": _six_digits(e.gain_error),
                        "exclusion": _six_digits(e.exclusion),
                        "signature": e.signature,
                    },
                }
                for e in self.effects
            ],
            "where": list(self.where),
            "error": {
                "unit": unit,
                "block": self.block,
                "noise_floor": _six_digits(self.rms("noise_floor", "held_out")),
                **{
                    role: {when: _six_digits(self.rms(when, role)) for when in ("before", "after")}
                    for role in ("fit", "held_out")
                },
            },
            "runners_up": [{"name": n, "share": _six_digits(s)} for n, s in self.runners_up],
            "refused": [
                {
                    "name": r.name,
                    "location": r.location,
                    "share": _six_digits(r.share),
                    "why": list(r.objections),
                }
                for r in self.refused
            ],
            "skipped": [
                {"name": s.effect, "location": s.location, "beside": list(s.beside), "reason": s.reason}
                for s in self.skipped
            ],
            "unidentified": list(self.unidentified),
            "remainder": None if self.remainder is None else _six_digits(self.remainder.to_dict()),
            "next": list(self.next_steps),
            "model": model,
        }

    def rows(self) -> Sequence[tuple[str, ...]]:
        """Return a table of the gap: block, record, role, before, after, noise floor."""
        return [
            (
                g.block,
                g.record,
                g.role,
                with_unit(f"{g.before:.3g}", g.unit),
                with_unit(f"{g.after:.3g}", g.unit),
                with_unit(f"{g.noise_floor:.3g}", g.unit),
            )
            for g in self.gaps
        ]

    def __str__(self) -> str:
        sentences = (self.words(), *self.where, *self.skipped_words(), *self.next_steps)
        return "\n".join([f"verdict: {self.verdict}", *sentences])


def _six_digits(content: Any) -> Any:
    """Return numbers in any nest of mappings and lists as they are written: the last digits mean nothing."""
    if isinstance(content, float):
        return significant([content], 6)[0]
    if isinstance(content, dict):
        return {key: _six_digits(value) for key, value in content.items()}
    return [_six_digits(each) for each in content] if isinstance(content, list) else content
