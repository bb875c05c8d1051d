"""The diagnosis of this package."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks._score_digest import digest
from benchmarks._score_run import opened
from nlsdesign.bench.discrepancy import diagnose
from nlsdesign.foundation.locations import version

NAME = f"nlsdesign {version()}, code {digest()}"


def answer(folder: Path) -> dict[str, Any]:
    """Return what a verdict with default settings says.

    Parameters
    ----------
    folder
        Of the case.
    """
    verdict = diagnose(*opened(folder))
    return {
        "effects": [
            {
                "name": effect.name,
                "part": effect.location.partition(".")[0],
                "probability": effect.probability,
                "numbers": {n: [value, error] for n, (value, _, error) in effect.parameters.items()},
            }
            for effect in verdict.effects
        ],
        "numbers": {
            p.name: [fit.values[p.name], fit.standard_error(p.name)]
            for fit in verdict.fits
            for p in fit.parameters
            if p.name in fit.values
        },
        "unknown": not verdict.effects and verdict.verdict != "none",
    }
