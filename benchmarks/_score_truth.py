"""True numbers behind the records of a case, by the name that the diagnosis gives them, and coverage."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks._score_cases import Case
from nlsdesign.bench.discrepancy import Verdict
from tests.rig import ACTUATORS, Hidden, truth
from tests.rig.kind_cases import ALL_KINDS, truth_of
from tests.rig.machines import MACHINES, true_numbers_of_machine

INTERVAL = 1.96
SIZES: Mapping[str, tuple[str, Callable[[Hidden], float]]] = {
    "coulomb_friction": ("sliding_effort", lambda h: h.friction),
    "load_dependent_friction": ("ratio", lambda h: h.load_friction),
    "quadratic_drag": ("drag", lambda h: h.drag),
    "torque_ripple": ("order", lambda h: h.ripple_order),
    "backlash": ("gap", lambda h: h.gap),
    "drive_delay": ("delay", lambda h: h.drive_delay),
    "cable_compliance": ("stiffness", lambda h: h.cable_stiffness),
    "cable_slack": ("length", lambda h: h.slack),
    "cam_angle_offset": ("offset", lambda h: h.cam_offset),
    "second_relaxation": ("modulus", lambda h: h.branch_modulus),
    "current_sensor_bias": ("bias", lambda h: h.current_bias),
    "force_sensor_bias": ("bias", lambda h: h.force_bias),
    "force_sensor_gain": ("gain", lambda h: h.force_gain),
    "force_sensor_delay": ("delay", lambda h: h.force_delay),
    "force_sensor_drift": ("drift", lambda h: h.force_drift),
    "constant_torque": ("load", lambda h: -h.constant_torque),
}
"""Numbers of effects that mean the same in the package and in the rig: only these have a true value."""

TrueNumbers = tuple[Mapping[tuple[str, str], float], Mapping[str, float]]


def true_numbers(case: Case) -> TrueNumbers:
    """Return true sizes by effect and last name of its number, and true declared numbers by full name.

    Parameters
    ----------
    case
        Whose records they are behind.
    """
    if case.machine in ALL_KINDS:
        truth_of_kind = truth_of(case.machine, case.effects, case.strength, case.seed)
        return truth_of_kind.sizes, truth_of_kind.numbers
    if case.machine in MACHINES:
        return true_numbers_of_machine(MACHINES[case.machine], case.hidden, case.seed)
    built, hidden = truth(ACTUATORS[case.machine], case.hidden, case.seed)
    sizes = {(e, SIZES[e][0]): SIZES[e][1](hidden) for e in case.effects if e in SIZES}
    drive, rubber = built.drivetrain, built.rubber
    return sizes, {
        "motor.inertia": drive.inertia,
        "motor.torque_constant": drive.torque_constant,
        "bearing.damping": drive.viscosity,
        "spring.cable.rubber.relaxing.spring.modulus": rubber.k,
        "spring.cable.rubber.relaxing.dashpot.viscosity": rubber.eta,
    }


def covered(verdict: Verdict, numbers: TrueNumbers) -> dict[str, list[float | bool]]:
    """Return for each true number that the verdict states: value, standard error, truth, whether inside.

    Parameters
    ----------
    verdict
        Of the case.
    numbers
        Of :func:`true_numbers`.
    """
    sizes, declared = numbers
    rows: dict[str, list[float | bool]] = {}
    for effect in verdict.effects:
        for name, (value, _, error) in effect.parameters.items():
            true = sizes.get((effect.name, name.rpartition(".")[2]))
            if true is not None:
                rows[f"{effect.name}:{name}"] = _row(value, error, true)
    for fit in verdict.fits:
        for name, true in declared.items():
            if name in fit.values and name in [p.name for p in fit.parameters]:
                rows[name] = _row(fit.values[name], fit.standard_error(name), true)
    return rows


def _row(value: float, error: float, true: float) -> list[float | bool]:
    return [float(value), float(error), float(true), bool(abs(value - true) <= INTERVAL * error)]
