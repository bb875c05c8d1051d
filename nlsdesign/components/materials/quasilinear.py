"""Relaxation of a law that is not linear, by the same shares at every strain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...foundation.arrays import Array
from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import Combination, Scope
from ..core.part_numbers import parameter


@dataclass(frozen=True, kw_only=True)
class QuasilinearRelaxation(Combination):
    """Laws that relax: F = F_e + Σ gᵢ·(F_e − yᵢ), dyᵢ/dt = (F_e − yᵢ)/τᵢ, F_e the effort of those inside.

    F_e is the effort at equilibrium, yᵢ what branch i has relaxed to, gᵢ its share. A small motion about any
    strain sees the tangent of F_e times 1 + Σ gᵢ·iωτᵢ/(1 + iωτᵢ), so loss tangent and relaxation are the same
    at every strain, as linear branches beside a law that stiffens are not. With a linear law inside it is a
    Prony series with moduli gᵢ·E. Valid where relaxation curves at different strains differ by a factor only.
    What it loses is not noted, so it does not stand inside a self-heating law that asks for it.
    Sources: Fung 1993, sec. 7.6 (this form); Simo 1987 (states yᵢ).

    Raises
    ------
    ValueRangeError
        If there is not one relaxation time per share.

    Examples
    --------
    >>> from nlsdesign.components import NeoHooke
    >>> gum = (("stiff", NeoHooke(shear_modulus=0.4e6)),)
    >>> round(QuasilinearRelaxation(members=gum, shares=(0.1, 0.1), times=(0.01, 0.1)).loss_tangent(1.0), 4)
    0.0499
    """

    phenomena: ClassVar[frozenset[str]] = frozenset({"relaxation"})

    shares: Quantity = parameter(
        "1", "shares gᵢ of the effort at equilibrium", minimum=0.0, maximum=1e4, row=True
    )
    times: Quantity = parameter("s", "relaxation times τᵢ", minimum=1e-6, maximum=1e9, row=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.shares.values) != len(self.times.values):
            raise ValueRangeError(
                f"shares ({len(self.shares.values)}) and times ({len(self.times.values)})",
                "there must be one relaxation time per share",
            )

    def factor(self, frequency: Array | float) -> NDArray[np.complex128]:
        """Return the complex modulus over the tangent modulus at equilibrium, shape of the frequency.

        Parameters
        ----------
        frequency
            In Hz.
        """
        return relaxation_factor(np.array(self.shares.values), np.array(self.times.values), frequency)

    def loss_tangent(self, frequency: float) -> float:
        """Return the loss tangent at a frequency in Hz.

        Parameters
        ----------
        frequency
            In Hz.
        """
        factor = self.factor(frequency)
        return float(factor.imag / factor.real)

    def effort(self, scope: Scope, motion: Expression, rate: Expression) -> Expression:
        """Return the effort at equilibrium and what has not relaxed yet."""
        equilibrium, domain = self.inside(scope, motion, rate), self.domain
        rows = zip(scope.row("shares"), scope.row("times"), strict=True)
        total = equilibrium
        for number, (share, time) in enumerate(rows, start=1):
            relaxed = scope.state(
                f"relaxed_{number}", domain.effort_unit,
                f"{domain.effort} to which branch {number} of {scope.path} has relaxed",
            )  # fmt: skip
            excess = equilibrium - relaxed
            scope.derive(relaxed, excess / time)
            total += share * excess
        return total


def relaxation_factor(shares: Array, times: Array, frequency: Array | float) -> NDArray[np.complex128]:
    """Return 1 + Σ gᵢ·iωτᵢ/(1 + iωτᵢ), the shape of the frequency."""
    turn = 2j * np.pi * np.asarray(frequency)[..., None] * times
    factor: NDArray[np.complex128] = 1.0 + np.sum(shares * turn / (1.0 + turn), axis=-1)
    return factor
