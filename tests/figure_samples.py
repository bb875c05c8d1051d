"""Made-up but plausible results, small enough to draw in every test."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from nlsdesign.design import (
    ExponentialTorque,
    MotorAndGear,
    ParetoFront,
    Task,
    TaskCurve,
    ToleranceResult,
    curve_for_task,
    tolerance_analysis,
)
from nlsdesign.design.optimisation.pareto import FrontPoint
from nlsdesign.design.statics.contour import contour_from_curvature
from nlsdesign.feedback.analysis import Chart
from nlsdesign.feedback.control import LoopMargins, LoopVerdict, OutputImpedance, SineResponse
from nlsdesign.feedback.control.evaluation.linear_loop import LinearLoop
from nlsdesign.feedback.control.evaluation.margins import CoupledStability
from nlsdesign.feedback.control.evaluation.onset import SaturationLine
from nlsdesign.foundation.quantity import degrees
from nlsdesign.model import Variable
from nlsdesign.presentation import figures
from nlsdesign.presentation.figures.before_after import (
    CandidateShare,
    HeldOut,
    binned_errors,
    candidate_shares,
    held_out_series,
)
from nlsdesign.presentation.figures.cam_motion import CamMotion, cam_motion
from nlsdesign.presentation.figures.loop_evaluation import coupled_stability_map
from nlsdesign.presentation.figures.over_time import ClosedLoopRun
from nlsdesign.presentation.figures.sweep_figures import (
    PointKinds,
    ShownColumn,
    SurfacePanel,
    answer_histograms,
    answers_against,
    response_surfaces,
    sensitivity_bars,
)
from nlsdesign.simulation import Trace
from tests import cam_cases

TARGET = ExponentialTorque(maximum=5.0, angle=degrees(53.0), shape=1.0, tolerance=0.05)
TIME = np.linspace(0.0, 1.0, 4001)


def motion() -> CamMotion:
    """A convex cam whose radius of curvature falls from 9 to 4 mm, with a stiffening rubber."""
    nodes = np.linspace(0.0, 1.3, 14)
    contour = contour_from_curvature(
        nodes, np.linspace(9e-3, 4e-3, 14), first_slope=5e-3, anchor_distance=25e-3
    )
    return cam_motion(
        contour, lambda e: 9e3 * e + 6e5 * e**2, elements=2.0, rest_length=12.5e-3, pretension=4e-3, count=41
    )


def chart(scale: float = 1.0, *, rank: float = 3.0) -> Chart:
    """Not observable at zero."""
    angle = np.radians(np.linspace(-50.0, 50.0, 41))
    size = np.abs(np.sin(angle))
    with np.errstate(divide="ignore"):
        columns = {
            "observability.rank": np.where(size > 0.0, rank, rank - 1.0),
            "observability.condition": scale * 40.0 / size,
            "deviation.model": 2e-3 * np.sqrt(size),
            "deviation.best": 1.2e-3 * np.sqrt(size),
            "sliding.decay": -8.0 * size,
            "sliding.frequency": 18.0 * size,
            "sliding.damping_ratio": 0.1 + 0.0 * size,
            "stuck.decay": -70.0 + 0.0 * size,
            "stuck.frequency": 0.0 * size,
            "stuck.damping_ratio": 1.0 + 0.0 * size,
            "stiffness.slow": 8.0 * size,
            "stiffness.fast": 9.0 * size,
        }
    names = tuple(Variable(name, "1", name) for name in columns)
    return Chart(
        Variable("motor.angle", "rad", "angle"), angle, names, np.array(list(columns.values())).T, {}
    )


def torque() -> np.ndarray:
    return 2.0 * np.sin(2 * np.pi * 2.0 * TIME) ** 3


def loop(lag: float) -> tuple[np.ndarray, np.ndarray]:
    phase = np.linspace(0.0, 2 * np.pi, 3000, endpoint=False)
    return 0.7 * np.sin(phase), 2.0 * np.sin(phase + lag)


def closed_loop() -> ClosedLoopRun:
    signals = {
        "reference": np.interp(TIME + 0.01, TIME, torque()),
        "plant.spring.torque": torque(),
        "observer.spring.torque": torque() + 0.02 * np.sin(80 * TIME),
        "plant.motor.current": 9.0 * np.cos(12 * TIME),
    }
    return figures.closed_loop_of(
        Trace(TIME, signals, dict.fromkeys(signals, "N*m")),
        desired="reference",
        true="plant.spring.torque",
        estimated="observer.spring.torque",
        current="plant.motor.current",
        current_limit=12.0,
    )


def held_out() -> HeldOut:
    noise = 0.08 * np.random.default_rng(7).standard_normal(len(TIME))
    force = 20.0 * torque()
    return HeldOut(TIME, force + noise, force + np.sign(force), 1.001 * force, "force", "N", 0.08)


RECORDS = (
    figures.RecordError("steps", 1.4, 0.15, 0.09, False),
    figures.RecordError("multisine", 1.25, 0.13, 0.085, True),
    figures.RecordError("slow sine", 0.9, 0.11, 0.08, False),
)
SHARES = (
    CandidateShare("second_relaxation", 0.31),
    CandidateShare("coulomb_friction", 0.97, True),
    CandidateShare("force_sensor_delay", -0.02),
)


def against_target() -> figures.Figure:
    angle = np.linspace(0.0, TARGET.last_angle, 90)
    return figures.torque_against_target(TARGET, {"cam of the deck": (angle, TARGET.torque(angle) + 0.01)})


def against_measured() -> figures.Figure:
    angle, points = np.linspace(-0.8, 0.8, 161), np.radians(np.arange(-40.0, 45.0, 5.0))
    return figures.torque_against_measured(
        {"model": (angle, 4.3 * angle**3), "Hooke fit": (angle, 2.0 * angle)},
        {"measured": (points, 4.4 * points**3)},
        notes={"model": "13.1 %"},
    )


def front() -> ParetoFront:
    """Three goals; nothing to make whole designs from."""
    size = np.linspace(6.5e-3, 10.5e-3, 7)
    points = tuple(
        FrontPoint((2.6e-6 * (10.5e-3 / r) ** 1.3, float(r), 0.02 + 3.0 * float(r)), (), (), ()) for r in size
    )
    goals = ("rubber volume", "cam radius", "energy lost per cycle")
    return ParetoFront(TARGET, goals, ("cm^3", "mm", "%"), points[::-1], (), ())


@functools.cache
def task_curve() -> TaskCurve:
    """A joint that swings like a pendulum with a second harmonic in its torque."""
    phase = np.linspace(0.0, 2 * np.pi, 101)
    task = Task(
        time=phase / 6.0, angle=0.4 * np.sin(phase), torque=-4.0 * np.sin(phase) + 0.8 * np.cos(3 * phase)
    )
    drive = MotorAndGear(inertia=1.4e-5, torque_constant=0.03, resistance=0.3, gear_ratio=80.0)
    return curve_for_task(task, drive)


def loop_responses() -> list[SineResponse]:
    at, good = np.geomspace(0.1, 11.0, 12), LoopVerdict("settled", 0.01, math.nan, 0.0, 4.0, 0.02)
    lost = LoopVerdict("limit cycle", 0.5, 40.0, 0.4, 20.0, 0.02)
    answer = 1.0 / (1.0 + 1j * at / 8.0)
    broken = np.where(at > 5.0, np.nan, answer)
    return [
        SineResponse(0.8, at, answer, 0.01 * at, (good,) * 12),
        SineResponse(2.8, at, broken, 0.01 * at, tuple(lost if np.isnan(v) else good for v in broken)),
    ]


def saturation() -> SaturationLine:
    at = np.geomspace(0.1, 11.0, 12)
    return SaturationLine(at, 4.0 - 0.2 * at, 0.5 + 0.0 * at, ("angle",) * 12)


def linear_loop() -> LinearLoop:
    angles, count = np.linspace(0.0, 0.8, 9), 9
    shape = np.zeros((count, 1, 1))
    reached = np.ones(count, dtype=bool)
    return LinearLoop(
        angles, 4.0 * angles, angles, reached, 1e-3, ("x",), ("u",), ("y",), 0.9 + shape, shape, shape, shape,
        shape, 1.0,
    )  # fmt: skip


def loop_margins() -> LoopMargins:
    linear = linear_loop()
    falls = 20.0 - 15.0 * linear.angles
    return LoopMargins("plant.motor.current", linear, falls, -falls, 3.0 * falls, 1e-4 * falls, falls)


def impedance() -> OutputImpedance:
    at, linear = np.geomspace(0.1, 400.0, 50), linear_loop()
    spring = 1.0 / (2j * np.pi * at) + 0.01 - 1e-4 * at
    return OutputImpedance(linear, at, np.outer(1.0 + linear.angles, spring))


def coupled() -> CoupledStability:
    inertias, stiffnesses = np.geomspace(1e-5, 1e-1, 5), np.array([0.0, 1.0, 10.0])
    radius = 1.01 - 0.005 * np.log10(1e5 * np.outer(inertias, np.ones(3)))
    return CoupledStability(0.4, inertias, stiffnesses, radius, 40.0 * radius)


def made_springs() -> ToleranceResult:
    """Springs with contact errors and a trim, from few draws."""
    return tolerance_analysis(cam_cases.actuator(cam_cases.CONCAVE, pretension=2e-3), target=TARGET, draws=40)


BESIDE = (np.array([1.0, 2.0, 5.0]), np.array([0.1, np.nan, 0.3]))


def sweep_points() -> tuple[list[ShownColumn], PointKinds]:
    """Two axes and two answers of 40 points, of which two failed, four are misses and one is on the front."""
    x, y = np.random.default_rng(3).uniform(1.0, 2.0, (2, 40))
    masks = [np.isin(np.arange(40), chosen) for chosen in ([7], [1, 2, 3, 4], [5, 6])]
    columns = [("area", "mm^2", x), ("inertia", "kg*m^2", y), ("error", "N*m", x * y), ("mass", "kg", x - y)]
    kinds = PointKinds(np.arange(40), *masks)
    return [ShownColumn(*each) for each in columns], kinds


def surfaces() -> figures.Figure:
    (x, y, error, _), kinds = sweep_points()
    nodes = np.linspace(1.0, 2.0, 9)
    panel = SurfacePanel(error.label, x, y, kinds, (nodes, nodes), np.outer(nodes, nodes))
    return response_surfaces([panel], words="Error over area and inertia, larger where both are large.")


def distributions() -> figures.Figure:
    columns = sweep_points()[0][2:]
    marks = [(0.5, 1.1, 0.9, 1.3), (0.95, 1.4, 1.2, math.nan)]
    return answer_histograms(
        columns, [marks, marks], words="Error and mass of 40 points, two quantiles each."
    )


def shares() -> figures.Figure:
    rows = [
        ("area", 0.6, 0.1, 0.7, 0.1),
        ("inertia", 0.2, 0.1, 0.3, 0.1),
    ]
    return sensitivity_bars({"error": rows}, words="Area causes 60 % of the variance of the error.")


def front_of_sweep() -> figures.Figure:
    columns, kinds = sweep_points()
    return answers_against(
        columns[2:],
        kinds,
        wanted=[None, 0.1],
        words="Error over mass of 40 points, one of them on the front.",
    )


FIGURES: dict[str, Callable[[], figures.Figure]] = {
    "cam_positions": lambda: figures.cam_positions(motion()),
    "torque_curve": lambda: figures.torque_curve(motion(), at=30),
    "torque_against_target": against_target,
    "tolerance_bars": lambda: figures.tolerance_bars(made_springs()),
    "torque_band": lambda: figures.torque_band(made_springs()),
    "torque_against_measured": against_measured,
    "torque_loops": lambda: figures.torque_loops({"25°": (loop(0.1), loop(0.12))}),
    "observability": lambda: figures.observability_over_angle(
        {"F_M": chart(), "published": chart(3.0, rank=4)}
    ),
    "stability": lambda: figures.stability_over_angle({"model": chart()}),
    "observer_error": lambda: figures.observer_error(TIME, torque(), {"F_M": torque() + 0.01}),
    "closed_loop": lambda: figures.closed_loop(
        closed_loop(), differences={"torque": 1e-8 * TIME}, bound=1e-6
    ),
    "gap_bars": lambda: figures.gap_bars(RECORDS, unit="N"),
    "held_out_series": lambda: held_out_series(held_out()),
    "binned_errors": lambda: binned_errors(
        (TIME[::200], torque()[::200]),
        (TIME[::200], 0.1 * torque()[::200]),
        across="motor.angle in rad",
        unit="N*m",
        name="block load",
    ),
    "pareto_front": lambda: figures.pareto_front(front()),
    "motor_over_task": lambda: figures.motor_over_task(task_curve()),
    "curve_of_task": lambda: figures.curve_of_task(task_curve()),
    "torque_responses": lambda: figures.torque_responses(loop_responses(), saturation()),
    "impedance": lambda: figures.impedance_over_frequency(impedance()),
    "margins": lambda: figures.margins_over_angle([loop_margins()]),
    "coupled_stability": lambda: coupled_stability_map(coupled()),
    "beside_points": lambda: figures.curves_beside_points(
        [figures.PointPanel("Torque", "torque in N·m", {"one": BESIDE, "two": BESIDE}, {"one": BESIDE})],
        across="frequency in Hz",
        words="Two curves, one of them with points, at 1 to 5 Hz; one value is missing.",
    ),
    "candidate_shares": lambda: candidate_shares(SHARES),
    "response_surfaces": surfaces,
    "answer_histograms": distributions,
    "sensitivity_bars": shares,
    "answers_against": front_of_sweep,
}


@functools.cache
def drawn(name: str) -> figures.Figure:
    """Draw a sample, once for all tests of a process; nobody changes it."""
    return FIGURES[name]()
