"""A servo with a weight on its arm: what its linear model lacks, judged in closed loop at a gain held out.

Twelve logs of a Dynamixel XL330-M288-T, four gains of its position controller and three motions, from the
public repository Rhoban/bam (Apache-2.0). They are read where they are. The position is simulated from the
goal alone, over the whole log, with numbers fitted to the logs of the other three gains.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

import nlsdesign as nls
from nlsdesign.components import Assembly, LoadFriction, tie
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.quantity import Quantity
from nlsdesign.model import FlatModel
from nlsdesign.presentation.report import TableSection

from ._measured import data_folder, write_skipped

MAPPING = Path(__file__).with_name("xl330_records.toml")
GAIN_PER_KP = 8.517 / 400.0  # V/rad for each unit of kp
CREEP = 0.015  # rad/s; a weight that is held for seconds must not sink
SUBSTEPS, SKIP = 7, 4
SIGMA = 0.01  # rad; errors far beyond it count in proportion, not squared
ITERATIONS = 9
LINEAR = {"servo.inertia": 0.0064, "servo.torque_constant": 0.28, "bearing.damping": 0.015}
LOADED = {"servo.inertia": 0.0065, "servo.torque_constant": 0.305, "bearing.damping": 0.004}
"""Where fits begin, near what shorter ones gave: the cost has several minima."""


@dataclass(frozen=True)
class Log:
    """One log: gain, goal, position, and the time between samples in s."""

    kp: int
    goal: Array
    position: Array
    step: float


@dataclass(frozen=True)
class Variant:
    """A model, and the numbers that it leaves open with their starts."""

    name: str
    servo: Assembly
    starts: Mapping[str, float]


@dataclass(frozen=True)
class Results:
    """Mean absolute error of the position in rad by variant, mean of four gains held out, and numbers."""

    errors: Mapping[str, float]
    fitted: Mapping[str, float]

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers by name."""
        return {**{f"{name}_error_mrad": 1e3 * e for name, e in self.errors.items()}, **self.fitted}


def main(out: Path, fast: bool = False, data: Path | None = None) -> Results | None:
    """Fit the closed loop with and without what the linear model lacks, one gain held out at a time.

    ``data``: folder with the logs; see :func:`data_folder`. Result: ``None`` where the measurements are not
    on this machine.
    """
    folder = data_folder("xl330", data)
    if folder is None:
        write_skipped("xl330", out)
        return None
    steps = nls.progress.Steps()
    declared = nls.declare(nls.load_deck("xl330_pendulum"))
    logs = load_logs(folder, declared)
    errors, numbers = {}, dict[str, float]()
    for variant in variants(declared):
        with steps.step(variant.name):
            errors[variant.name], numbers = held_out_error(variant, logs)
    better = variants(declared)[-1].servo.with_values(numbers)
    nls.write_deck(better, out / "refitted.toml")
    results = Results(errors, {"load_friction_ratio": numbers["weight.ratio"]})
    rows = tuple((name.replace("_", " "), f"{error:.4f}") for name, error in errors.items())
    nls.write_report(
        out / "report.html",
        TableSection(
            "Closed loop, one gain held out",
            ("model", "mean absolute error in rad"),
            rows,
            caption="Simulated position against the measured one, at a gain that no fit has seen.",
        ),
        title="XL330: what is missing",
    )
    return results


def variants(declared: Assembly) -> list[Variant]:
    """Return the linear servo, and the one with friction in proportion to the weight on its gear."""
    ratio = Quantity(0.3, "1", "to be fitted")
    weight = LoadFriction(members=(("held", declared.element("weight")),), ratio=ratio)
    loaded = declared.with_part("weight", tie(weight.smooth(CREEP), "servo"))
    return [
        Variant("linear", declared, LINEAR),
        Variant("load_friction", loaded, {**LOADED, "weight.ratio": 0.42}),
    ]


def load_logs(folder: Path, declared: Assembly) -> list[Log]:
    """Return the logs on one clock, all of the length of the shortest."""
    model = nls.flatten(declared)
    records = nls.load_records(folder, model, mapping=MAPPING)
    least = min(len(r.trace) for r in records.records)
    return [
        Log(
            int(r.name.partition("_")[0].removeprefix("kp")),
            r.trace["servo.goal"][:least],
            r.trace["encoder.reading"][:least],
            r.step,
        )
        for r in records.records
    ]


def held_out_error(variant: Variant, logs: Sequence[Log]) -> tuple[float, dict[str, float]]:
    """Return the mean over the gains of the error at a gain held out, and the numbers of the last fold."""
    model, names = nls.flatten(variant.servo), list(variant.starts)
    run = closed_loop(model, len(logs[0].goal) - 1, logs[0].step)
    errors, values = [], dict[str, float]()
    for kp in sorted({log.kp for log in logs}):
        seen = [log for log in logs if log.kp != kp]

        def residual(scaled: Array, seen: Sequence[Log] = seen) -> Array:
            numbers = dict(zip(names, np.exp(scaled), strict=True))
            rest = [(predicted(run, model, numbers, log) - log.position)[::SKIP] for log in seen]
            return np.nan_to_num(np.clip(np.concatenate(rest), -5.0, 5.0), nan=5.0) / SIGMA

        start = np.log(list(variant.starts.values()))
        best = least_squares(residual, start, loss="soft_l1", max_nfev=ITERATIONS, diff_step=1e-4)
        values = {name: float(v) for name, v in zip(names, np.exp(best.x), strict=True)}
        own = [log for log in logs if log.kp == kp]
        errors.append(np.mean([np.abs(predicted(run, model, values, g) - g.position) for g in own]))
    return float(np.mean(errors)), values


def closed_loop(model: FlatModel, count: int, step: float) -> ca.Function:
    """Return the states along a record, by Runge and Kutta's steps of fourth order, lines between goals."""
    s = model.symbols()
    rate = ca.Function("rate", [s.state, s.input, s.parameter], [s.derivative])
    sizes = [len(model.states), 2, len(model.parameters)]
    state, ends, parameter = (ca.MX.sym(n, size) for n, size in zip("xup", sizes, strict=True))
    h, now = step / SUBSTEPS, state
    for k in range(SUBSTEPS):
        left, middle, right = (
            ends[0] + (ends[1] - ends[0]) * ((k + share) / SUBSTEPS) for share in (0, 0.5, 1)
        )
        k1 = rate(now, left, parameter)
        k2 = rate(now + h / 2 * k1, middle, parameter)
        k3 = rate(now + h / 2 * k2, middle, parameter)
        k4 = rate(now + h * k3, right, parameter)
        now = now + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return ca.Function("step", [state, ends, parameter], [now]).expand().mapaccum("run", count)


def predicted(run: ca.Function, model: FlatModel, values: Mapping[str, float], log: Log) -> Array:
    """Return the position over a log, from its first position at rest and the goal."""
    gain = {"servo.loop.proportional": GAIN_PER_KP * log.kp}
    numbers = {**model.values, **values, **gain}
    parameter = np.array([numbers[v.name] for v in model.parameters])
    state = np.zeros(len(model.states))
    names = [v.name for v in model.states]
    state[names.index("servo.angle")] = log.position[0]
    ends = np.vstack([log.goal[:-1], log.goal[1:]])
    path = np.array(run(state, ends, np.repeat(parameter[:, None], ends.shape[1], axis=1)))
    return np.concatenate([log.position[:1], path[names.index("servo.angle")]])
