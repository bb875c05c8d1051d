"""What ``make bench`` runs: each benchmark with what is promised of it, its peer, and what it needs."""

from __future__ import annotations

import importlib.util
import re
import shutil
from dataclasses import dataclass
from typing import NamedTuple


class Promise(NamedTuple):
    """A figure that is promised, and how it is read in what the benchmark prints.

    ``pattern`` has one group, the number; every match counts. ``least`` or ``most`` is what is promised.
    """

    words: str
    pattern: str
    least: float | None = None
    most: float | None = None

    def measured(self, output: str) -> list[float]:
        return [float(each.replace(",", "")) for each in re.findall(self.pattern, output)]

    def promised(self) -> str:
        bounds = [("at least", self.least), ("at most", self.most)]
        return " and ".join(f"{words} {bound:g}" for words, bound in bounds if bound is not None) or "none"

    def met(self, numbers: list[float]) -> bool | None:
        """Whether all of them keep the promise; None where nothing was promised or measured."""
        if not numbers or (self.least is None and self.most is None):
            return None
        return all((self.least is None or n >= self.least) and (self.most is None or n <= self.most)
                   for n in numbers)  # fmt: skip


@dataclass(frozen=True)
class Benchmark:
    """One of ``python -m benchmarks.NAME``."""

    name: str
    title: str
    peers: str
    promises: tuple[Promise, ...]
    arguments: tuple[str, ...] = ()
    programs: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()

    @property
    def command(self) -> str:
        return " ".join(["python", "-m", f"benchmarks.{self.name}", *self.arguments])

    def lacking(self) -> str:
        """Why it cannot run here; empty if it can."""
        programs = [name for name in self.programs if shutil.which(name) is None]
        modules = [name for name in self.modules if importlib.util.find_spec(name) is None]
        return ", ".join([*programs, *modules]) and f"not installed: {', '.join([*programs, *modules])}"


SUITE = (
    Benchmark(
        "observer_step", "One step of an observer in C", "C written by hand, same compiler and flags",
        (Promise("instructions over those of C written by hand", r"(?m)^.*-O[23] .* ([\d.]+)$", most=1.1),),
        programs=("valgrind",), modules=("ziglang",),
    ),
    Benchmark(
        "bench_simulation", "Simulation of the smooth actuator at equal error", "`solve_ivp` of SciPy",
        (Promise("time of the peer over ours", r"([\d.]+) times the package's time"),),
    ),
    Benchmark(
        "bench_events", "Simulation with friction, backlash and encoder at equal error",
        "`solve_ivp` of SciPy with terminal events",
        (
            Promise("time of the peer over ours, interpreted", r"(\d+) times package"),
            Promise("time of the peer over ours, compiled step", r"(\d+) times compiled", least=50),
        ),
        modules=("ziglang",),
    ),
    Benchmark(
        "fit", "Fit of twelve parameters", "`least_squares` of SciPy around `solve_ivp`",
        (
            Promise("time of the peer over ours", r"ratio of the times (\d+)", least=20),
            Promise("seconds of ours", r"multiple shooting, +\d+ steps +([\d.]+)", most=5),
        ),
    ),
    Benchmark(
        "cam_design", "Joint design of cam and rubber", "SLSQP and trust-constr of SciPy, CMA-ES",
        (
            Promise("best cost of CMA-ES over ours", r"CMA-ES .*?: ([\d.e+-]+) times our cost", least=0.999),
            Promise("best cost of trust-constr over ours", r"trust-constr .*?: ([\d.e+-]+) times our cost",
                    least=0.999),
            Promise("time at which CMA-ES is at our cost, over ours", r"CMA-ES .*at ours after ([\d.]+|inf)",
                    least=50),
            Promise("time at which trust-constr is at our cost, over ours",
                    r"trust-constr .*at ours after ([\d.]+|inf)", least=50),
        ),
        arguments=("--limit", "5", "--only", "README", "flat"), modules=("cma",),
    ),
    Benchmark(
        "analysis_over_angle", "Observability, stability and best estimate at 2,001 angles",
        "a loop over SciPy and NumPy, angle by angle",
        (
            Promise("seconds of ours", r"all views in ([\d.]+) s", most=1),
            Promise("time of the peer over ours", r"([\d.]+) times as long"),
        ),
    ),
    Benchmark(
        "closed_loop", "Torque loop at 20 frequencies, and 1,000 draws",
        "`input_output_response` of python-control",
        (
            Promise("seconds for 20 frequencies", r"20 frequencies with counts: ([\d.]+)", most=2),
            Promise("time of the peer over ours", r"on the same loop: .*ratio (\d+)", least=50),
            Promise("seconds for 1,000 draws", r"1,000 draws: ([\d.]+)", most=60),
        ),
        modules=("ziglang",),
    ),
    Benchmark(
        "batches", "1,000 draws of the published loop in one batch",
        "one call of ours per draw; `solve_ivp` from sample to sample",
        (
            Promise("time of one call per draw over the batch", r"batch compiled ratio (\d+)", least=20),
            Promise("time of one call per draw over the batch without a compiler", r"NumPy ratio ([\d.]+)"),
            Promise(
                "time of one compiled call per draw over the batch",
                r"compiled call per draw: .* ([\d.]+) times",
            ),
            Promise("time of `solve_ivp` over the batch", r"sample: .* against the batch (\d+) times"),
            Promise("open simulations one by one over the batch", r"one by one .*, ([\d.]+) times"),
        ),
        modules=("ziglang",),
    ),
    Benchmark(
        "live", "Edits of the live design, from the edit to its answer as JSON",
        "none",
        (
            Promise("% of edits within 100 ms", r"all \d+ steps, wall.*100 ms +([\d.]+)", least=95),
            Promise("median in ms", r"all \d+ steps, wall +median +([\d.]+)"),
        ),
    ),
    Benchmark(
        "live_page", "The live page in a browser, from mouse to picture", "none",
        (
            Promise("seconds to the first paint", r"first paint ([\d.]+) s", most=1),
            Promise("ms from mouse to picture, 95 %",
                    r"from mouse to picture +\d+ +\d+ +(\d+)", most=100),
        ),
        arguments=("cam-actuator", "--moves", "300"), programs=("chromium",), modules=("starlette",),
    ),
    Benchmark(
        "observers", "Co-design of observers and errors over the spread",
        "SLSQP on eigenvalues; `solve_ivp` sample by sample",
        (
            Promise("seconds of a co-design", r"co-design ([\d.]+) s", most=5),
            Promise("time of `solve_ivp` over ours", r"of one run\), ratio (\d+)"),
        ),
        modules=("ziglang",),
    ),
)  # fmt: skip

ELSEWHERE = (
    ("Flash, memory and instructions on Cortex-M", "targets.md", "python -m benchmarks.targets"),
    ("Start-up, installation and disk", "install.md", "python -m benchmarks.first_minute --install"),
    ("FMUs in foreign masters", "fmi_masters.md", "python -m benchmarks.foreign_masters"),
    ("Deviations from MISRA C", "misra.md", "python -m benchmarks.misra"),
    ("How often the diagnosis is right", "discrepancy.md", "python -m benchmarks.discrepancy_score"),
    ("Random targets of a cam design", "cam_design.md", "python -m benchmarks.random_targets"),
    (
        "Sweeps of ten thousand points",
        "scale.md",
        "python -m benchmarks.sweeps --points 10000 --write docs/scale.md",
    ),
)
"""Measurements with a page of their own, which ``make bench`` does not repeat."""
