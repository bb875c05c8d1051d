"""Flat models written by hand: a cam-rubber plant, an observer scheduled over a table, a controller."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
from scipy.linalg import expm, solve_discrete_are

from nlsdesign.model.flat import FlatModel, Table, Variable

SAMPLE_TIME = 1e-3

PLANT_PARAMETERS = (
    Variable(
        "motor.inertia", "kg*m^2/rad^2", "Inertia at the cam", 5.97e-4, 1e-3, 1e-5, 1e-1, "2014 paper", 0.1
    ),
    Variable("motor.torque_constant", "N*m/A/rad", "Torque per current at the cam", 0.22, 0.2, 1e-3, 10.0),
    Variable("motor.friction.coulomb", "N*m/rad", "Coulomb friction", 0.02, 0.02, 0.0, 1.0),
    Variable("motor.friction.viscous", "N*m*s/rad^2", "Viscous friction", 1e-3, 1e-3, 0.0, 1.0),
    Variable("spring.cam.lever_arm", "m/rad", "Lever arm far from the centre", 0.015, 0.01, 1e-3, 0.1),
    Variable("spring.cam.corner", "rad", "Angle over which the lever arm grows", 0.2, 0.2, 1e-3, 2.0),
    Variable("spring.rubber.equilibrium.stiffness", "N/m", "Stiffness at rest", 9e3, 1e4, 0.0, 1e6),
    Variable(
        "spring.rubber.equilibrium.hardening", "1/m", "Relative hardening per extension", 60.0, 60.0, 0.0, 1e4
    ),
    Variable("spring.rubber.relaxing.spring.stiffness", "N/m", "Maxwell spring", 4.6e3, 1e4, 0.0, 1e6),
    Variable("spring.rubber.relaxing.dashpot.viscosity", "N*s/m", "Maxwell dashpot", 200.0, 100.0, 1e-3, 1e6),
)


def plant(*, outputs: tuple[str, ...] = ("motor.angle", "spring.torque")) -> FlatModel:
    """A cam that stretches two rubbers with one relaxation each, turned by a motor; load side fixed."""
    t, i = ca.SX.sym("t"), ca.SX.sym("i")
    z, theta, omega = (ca.SX.sym(n) for n in ("z", "theta", "omega"))
    p = ca.SX.sym("p", len(PLANT_PARAMETERS))
    inertia, constant, coulomb, viscous, arm, corner, stiffness, hardening, relaxing, eta = ca.vertsplit(p)
    # δ = h θ0 ln cosh(θ/θ0), so that dδ/dθ = h tanh(θ/θ0).
    extension = (
        arm
        * corner
        * (ca.fabs(theta / corner) + ca.log1p(ca.exp(-2 * ca.fabs(theta / corner))) - math.log(2))
    )
    lever = arm * ca.tanh(theta / corner)
    relaxing_force = relaxing * (extension - z)
    force = stiffness * extension * (1 + hardening * extension) + relaxing_force
    torque = 2 * lever * force
    friction = coulomb * ca.tanh(omega / 0.1) + viscous * omega
    f = ca.vertcat(relaxing_force / eta, omega, (constant * i - friction - torque) / inertia)
    known = {
        "motor.angle": (theta, "rad", "Angle of the motor at the cam"),
        "motor.speed": (omega, "rad/s", "Speed of the motor at the cam"),
        "spring.torque": (torque, "N*m/rad", "Torque of the spring"),
        "motor.power": (constant * i * omega, "W", "Power into the drive"),
    }
    signals = {
        "spring.rubber.force": (force, "N", "Force of one rubber"),
        "spring.torque": known["spring.torque"],
    }
    equations = ca.Function(
        "equations",
        [t, ca.vertcat(z, theta, omega), i, p, ca.SX.sym("w", 0)],
        [
            f,
            ca.vertcat(*[known[n][0] for n in outputs]),
            ca.vertcat(*[s[0] for s in signals.values()]),
            ca.SX(0, 1),
        ],
    )
    return FlatModel(
        "cam rubber plant",
        "Cam that stretches two rubbers, turned by a motor",
        (
            Variable("spring.rubber.relaxing.dashpot.extension", "m", "Extension of the dashpot", 0.0, 1e-3),
            Variable("motor.angle", "rad", "Angle of the motor at the cam", 0.1, 1.0, -2.0, 2.0),
            Variable("motor.speed", "rad/s", "Speed of the motor at the cam", 0.0, 10.0),
        ),
        (Variable("motor.current", "A", "Motor current", 0.0, 5.0, -20.0, 20.0),),
        PLANT_PARAMETERS,
        tuple(Variable(n, known[n][1], known[n][2]) for n in outputs),
        tuple(Variable(n, s[1], s[2]) for n, s in signals.items()),
        equations,
    )


def _linear(theta: float) -> tuple[np.ndarray, np.ndarray]:
    """A and B of (relaxing force, extension, angle, speed) for (current) at one angle, written by hand."""
    lever, corner, inertia, viscous = 0.015 * math.tanh(theta / 0.2), 0.2, 5.97e-4, 1e-3
    extension = 0.015 * corner * math.log(math.cosh(theta / corner))
    secant = 9e3 * (1 + 60.0 * extension)
    a = np.array(
        [
            [-4.6e3 / 200.0, 0, 0, 4.6e3 * lever],
            [0, 0, 0, lever],
            [0, 0, 0, 1],
            [-2 * lever / inertia, -2 * lever * secant / inertia, 0, -viscous / inertia],
        ]
    )
    return a, np.array([[0.0], [0.0], [0.0], [0.22 / inertia]])


def _observer_row(theta: float) -> np.ndarray:
    """Exact transition over one sample, effect of the current, and a steady-state Kalman gain."""
    a, b = _linear(theta)
    block = expm(np.block([[a, b], [np.zeros((1, 5))]]) * SAMPLE_TIME)
    transition, c = block[:4, :4], np.eye(4)[1:3]
    noise, sensor = np.diag([1.0, 1e-12, 1e-10, 1e-1]), np.diag([1e-10, 1e-7])
    spread = solve_discrete_are(transition.T, c.T, noise, sensor)
    gain = transition @ spread @ c.T @ np.linalg.inv(c @ spread @ c.T + sensor)
    return np.concatenate([transition.ravel(), block[:4, 4], gain.ravel()])


def observer(*, points: int = 61) -> FlatModel:
    """Four states, one table over the angle; extension (from the angle) and angle are measured."""
    rows = [_observer_row(theta) for theta in np.linspace(-1.5, 1.5, points).tolist()]
    columns = [Variable(f"transition[{i},{j}]", "1", "Transition") for i in range(1, 5) for j in range(1, 5)]
    columns += [Variable(f"effect[{i}]", "1", "Effect of the current") for i in range(1, 5)]
    columns += [Variable(f"gain[{i},{j}]", "1", "Correction") for i in range(1, 5) for j in range(1, 3)]
    table = Table("motor.angle", -1.5, 3.0 / (points - 1), tuple(columns), np.array(rows))

    t, x, u, w = ca.SX.sym("t"), ca.SX.sym("x", 4), ca.SX.sym("u", 2), ca.SX.sym("w", 28)
    scale, arm, corner = (ca.SX.sym(n) for n in ("scale", "arm", "corner"))
    turn = ca.fabs(u[0] / corner)
    extension = arm * corner * (turn + ca.log1p(ca.exp(-2 * turn)) - math.log(2))
    innovation = ca.vertcat(extension - x[1], u[0] - x[2])
    transition, gain = ca.reshape(w[:16], 4, 4).T, ca.reshape(w[20:], 2, 4).T
    f = transition @ x + w[16:20] * u[1] + scale * gain @ innovation
    torque = 2 * arm * ca.tanh(u[0] / corner) * (x[0] + 9e3 * extension * (1 + 60.0 * extension))
    equations = ca.Function(
        "equations",
        [t, x, u, ca.vertcat(scale, arm, corner), w],
        [f, ca.vertcat(torque, x[3]), innovation[1], ca.SX(0, 1)],
    )
    return FlatModel(
        "cam rubber observer",
        "Scheduled observer of the spring torque",
        (
            Variable("estimate.relaxing.force", "N", "Force of the relaxing branch"),
            Variable("estimate.extension", "m", "Extension"),
            Variable("estimate.angle", "rad", "Angle"),
            Variable("estimate.speed", "rad/s", "Speed"),
        ),
        (
            Variable("motor.angle", "rad", "Measured angle", 0.0, 1.0, -1.5, 1.5),
            Variable("motor.current", "A", "Motor current", 0.0, 5.0, -20.0, 20.0),
        ),
        (
            Variable("correction.scale", "1", "Scale of the correction", 1.0, 1.0, 0.0, 2.0),
            Variable(
                "cam.lever_arm", "m/rad", "Lever arm far from the centre", 0.015, 0.01, 1e-3, 0.1, "deck"
            ),
            Variable("cam.corner", "rad", "Angle over which the lever arm grows", 0.2, 0.2, 1e-3, 2.0),
        ),
        (
            Variable("spring.torque", "N*m/rad", "Estimated torque"),
            Variable("motor.speed", "rad/s", "Estimated speed"),
        ),
        (Variable("innovation", "rad", "Measured less estimated angle"),),
        equations,
        SAMPLE_TIME,
        (table,),
    )


def controller() -> FlatModel:
    """Proportional and integral torque control with a saturated integrator."""
    t, x, u, p = ca.SX.sym("t"), ca.SX.sym("x"), ca.SX.sym("u", 2), ca.SX.sym("p", 2)
    error = u[0] - u[1]
    integral = ca.fmin(ca.fmax(x + SAMPLE_TIME * p[1] * error, -5), 5)
    equations = ca.Function(
        "equations",
        [t, x, u, p, ca.SX.sym("w", 0)],
        [integral, p[0] * error + x, ca.SX(0, 1), ca.SX(0, 1)],
    )
    return FlatModel(
        "torque controller",
        "Proportional and integral torque control",
        (Variable("integral", "A", "Integral part"),),
        (
            Variable("torque.desired", "N*m/rad", "Desired torque", 0.0, 1.0, -10.0, 10.0),
            Variable("torque.actual", "N*m/rad", "Actual torque", 0.0, 1.0, -100.0, 100.0),
        ),
        (
            Variable("gain.proportional", "A*rad/N/m", "Proportional gain", 2.0, 1.0, 0.0, 1e3),
            Variable("gain.integral", "A*rad/N/m/s", "Integral gain", 40.0, 10.0, 0.0, 1e5),
        ),
        (Variable("motor.current", "A", "Commanded current"),),
        (),
        equations,
        SAMPLE_TIME,
    )
