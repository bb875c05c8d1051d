"""What dry friction does to the speed of an observer within one sample."""

from __future__ import annotations

import casadi as ca


def braked_speed(friction: ca.Function, sample_time: float) -> ca.Function:
    """Return the speed after friction has acted for one sample on the speed that all else left, ω -> ω⁺.

    Friction is stiff near zero speed: held at its value it would throw the speed from side to side. So it
    comes last (Lie splitting), its step is the exponential Rosenbrock–Euler one, Δω = T·f·(e^x − 1)/x with
    x = T·∂f/∂ω, which is exact where f is linear, and it may stop the speed but not turn it around.

    Parameters
    ----------
    friction
        ``casadi.Function`` ω -> ω̇.
    sample_time
        T in s.
    """
    speed = ca.SX.sym("speed")
    rate = ca.SX(friction(speed))
    x = sample_time * ca.jacobian(rate, speed)
    # Away from zero, where the quotient is undefined; its limit there is one.
    x = x - 1e-9 * (ca.fabs(x) < 1e-9)
    left = speed + sample_time * rate * ca.expm1(x) / x
    return ca.Function("braked", [speed], [left * (left * speed > 0)])
