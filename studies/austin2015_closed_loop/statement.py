"""A published statement with its outcome, and the causes that were switched off or added to decide it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nlsdesign.feedback.control import SineResponse

REPRODUCED, NOT_REPRODUCED = "reproduced", "not reproduced"
OTHERWISE = "explained otherwise"


@dataclass(frozen=True)
class LoopRun:
    """One loop that was run for a statement.

    Parameters
    ----------
    loop
        Which, and what was changed.
    outcome
        What it did, with the verdict where it did not settle.
    """

    loop: str
    outcome: str


@dataclass(frozen=True)
class Statement:
    """A statement, and what becomes of it in simulation.

    Parameters
    ----------
    stated
        In words, with who states it.
    outcome
        ``REPRODUCED``, ``NOT_REPRODUCED`` or ``OTHERWISE``.
    why
        What decides it.
    trials
        The loops that were run.
    """

    stated: str
    outcome: str
    why: str
    trials: tuple[LoopRun, ...]


def settles(response: SineResponse) -> bool:
    """Tell whether a loop settles at all frequencies."""
    return all(verdict.holds for verdict in response.verdicts)


def lost_at(response: SineResponse) -> tuple[float, ...]:
    """Return the frequencies in Hz at which a loop does not settle."""
    pairs = zip(response.frequency, response.verdicts, strict=True)
    return tuple(round(float(f), 2) for f, verdict in pairs if not verdict.holds)


def in_words(response: SineResponse) -> str:
    """Return magnitude by frequency where a loop settles, and where and how it does not."""
    good = np.isfinite(response.decibel)
    shown = ", ".join(
        f"{d:+.2f} dB at {f:.3g} Hz"
        for f, d in zip(response.frequency[good], response.decibel[good], strict=True)
    )
    lost = [(f, v) for f, v in zip(response.frequency, response.verdicts, strict=True) if not v.holds]
    if not lost:
        return shown
    where = ", ".join(f"{f:.3g}" for f, _ in lost)
    return f"{shown + '; ' if shown else ''}does not settle at {where} Hz: {lost[0][1]}"
