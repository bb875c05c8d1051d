"""A hypothesis about what is missing: an assembly with effects, fitted to the records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...components.assembly.named_parts import Assembly
from ...identification.estimation.least_squares import Fit
from ..effects.candidate import Candidate, Unknown


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An assembly fitted to the records.

    Parameters
    ----------
    assembly
        With declared numbers, and the effects added so far.
    added
        The effects, in the order in which they were added.
    values
        Fitted numbers by name.
    fits
        One for each group of blocks that share parameters, by the names of the blocks.
    chi2
        Sum of squared residuals in units of the noise floor by block and record.
    rows
        Number of residuals by block and record.
    worth
        How many independent residuals these are worth, coloured as they are.
    coarse
        Whether it was fitted to thinned records only.
    rough
        Whether a body coasts in it between contacts: one contact at the wrong moment, and the prediction
        stays wrong for a while, however right the effect.
    astray
        Blocks and records that such a body makes unpredictable; they count as the others do.
    """

    assembly: Assembly
    added: tuple[Candidate, ...]
    values: Mapping[str, float]
    fits: Mapping[tuple[str, ...], Fit]
    chi2: Mapping[tuple[str, str], float]
    rows: Mapping[tuple[str, str], int]
    worth: Mapping[tuple[str, str], float]
    coarse: bool = False
    rough: bool = False
    astray: frozenset[tuple[str, str]] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        """Identifiers of the effects."""
        return tuple(c.effect for c in self.added)

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Numbers that the effects brought along."""
        return tuple(u for c in self.added for u in c.unknowns)

    @property
    def prior(self) -> float:
        """Sum of squared departures from declared numbers, in standard deviations of their spread."""
        return float(sum(s**2 for f in self.fits.values() for s in f.strain().values()))

    @property
    def fitted(self) -> Assembly:
        """The assembly with the fitted numbers."""
        return self.assembly.with_values(self.values)
