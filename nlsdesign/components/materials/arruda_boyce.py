"""Eight chains of finite length: the law of Arruda and Boyce."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...foundation.quantity import Quantity
from ...foundation.symbolic import Expression
from ..core.element import Range, Scope
from ..core.part import parameter
from .hyperelastic import Hyperelastic

_SERIES = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)


@dataclass(frozen=True, kw_only=True)
class ArrudaBoyce(Hyperelastic):
    """Eight chains of N links each: W = μ·Σ Cᵢ/N^(i−1)·(I₁ⁱ − 3ⁱ), with I₁ = λ² + 2/λ.

    Cᵢ = 1/2, 1/20, 11/1050, 19/7000, 519/673750 are the series of the inverse Langevin function, within 0.5 %
    of it while the chains have no more than 0.6 of their full length, √(I₁/3) ≤ 0.6·√N; that is the range.
    Beyond it the series is too soft. Source: Arruda and Boyce 1993, eq. (15).

    Examples
    --------
    >>> ArrudaBoyce(shear_modulus=0.27e6, links=26.5).title()
    'ArrudaBoyce(shear_modulus = 270000 Pa, links = 26.5)'
    """

    shear_modulus: Quantity = parameter("Pa", "modulus μ of the chains", minimum=1.0, maximum=1e12)
    links: Quantity = parameter("1", "links N of a chain", minimum=3.0, maximum=1e6)

    @property
    def range_of_form(self) -> Range:
        """Strain from √(I₁/3) = 0.6·√N in compression to the same in tension."""
        roots = np.roots([1.0, 0.0, -3.0 * max(0.36 * self.links.number, 1.01), 2.0]).real
        low, high = sorted(root for root in roots if root > 0.0)
        return float(low) - 1.0, float(high) - 1.0

    def energy(self, scope: Scope, stretch: Expression) -> Expression:
        """Return the series to the fifth power of I₁."""
        first, links = stretch**2 + 2 / stretch, scope.parameter("links")
        terms = [c / links ** (i - 1) * (first**i - 3**i) for i, c in enumerate(_SERIES, start=1)]
        return ca.SX(scope.parameter("shear_modulus") * sum(terms[1:], start=terms[0]))
