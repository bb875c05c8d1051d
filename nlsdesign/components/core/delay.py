"""Transport delay of a signal as a rational function of the Laplace variable."""

from __future__ import annotations

from ...foundation.symbolic import Expression
from .element import Scope


def delayed(scope: Scope, value: Expression, unit: str) -> Expression:
    """Return a value as it was a time τ ago, in (2,2) Padé approximation, C∞.

    e^(−sτ) ≈ (1 − sτ/2 + s²τ²/12)/(1 + sτ/2 + s²τ²/12). The gain is 1 at every frequency, the phase error
    lies below (ωτ)⁵/720: 4e-5 rad at ωτ = 0.5. The states are a, which rests at the value, and b = τ·ȧ; the
    delayed value is v − b. Source: Golub and Van Loan 2013 (Padé table of the exponential).

    ``scope``: of a part with a number ``delay`` in s; takes the states ``lag`` and ``lag_change``.
    """
    tau = scope.parameter("delay")
    lag = scope.state("lag", unit, f"lagging value inside the delay of {scope.path}")
    change = scope.state("lag_change", unit, f"its change over one delay, in {scope.path}")
    scope.derive(lag, change / tau)
    scope.derive(change, (12 * (value - lag) - 6 * change) / tau)
    return value - change
