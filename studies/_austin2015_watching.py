"""Pages of the study of the published actuator: observers, co-simulation, files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import nlsdesign as nls


def observer_pages(done: dict[str, Any], results: dict[str, float]) -> list[Any]:
    """Show observability and what the observers make of the bench."""
    bench, watched, chart = done["bench"], done["watched"], {"figure-consistent deck": done["chart"]}
    first = bench.time <= 1.0
    estimates = {name: seen["spring.torque"][first] for name, seen in watched.items()}
    minimal, published = (results[f"observer_{name}_error_mNm_rms"] for name in ("minimal", "published"))
    free = done["free"]
    return [
        nls.report.Chapter(
            "Observer", "The torque is not measured: it is estimated from the encoder and the current."
        ),
        nls.report.FigureSection(
            "Observability over the cam angle",
            nls.figures.observability_over_angle(chart),
            caption="Rank and condition of angle, speed and rubber memory, seen through the encoder.",
            means="At zero angle the lever arm vanishes: the rubber's memory is not seen, nor needed.",
        ),
        nls.report.FigureSection(
            "Stability over the cam angle",
            nls.figures.stability_over_angle(chart),
            caption="Poles and stiffness of the actuator at rest.",
        ),
        nls.report.FigureSection(
            "Estimated torque on the bench",
            nls.figures.observer_error(bench.time[first], bench["spring.torque"][first], estimates),
            caption="Current 6 A at 2 Hz, 8192 counts per turn; the minimal form starts wrong.",
            means=f"After 1 s: {minimal:.2f} mN·m rms in minimal, {published:.2f} in the paper's form.",
        ),
        nls.report.FigureSection(
            "Free drivetrain",
            nls.figures.over_time(
                free.time,
                {n: np.degrees(free[f"{n}.angle"]) for n in ("motor", "load")},
                quantity="angle",
                unit="deg",
            ),
            caption="The load is let go: a link of 2e-3 kg·m² behind the spring, current 0.5 A at 2 Hz.",
        ),
        nls.report.TextSection("Observer", "The table and its error.", drawing=str(done["observer"])),
    ]


def loop_pages(done: dict[str, Any], results: dict[str, float]) -> list[Any]:
    """Show the co-simulated closed loop."""
    run, whole = done["run"].trace, done["whole"]
    loop = nls.figures.closed_loop_of(
        run,
        desired="controller.spring.torque.desired",
        true="plant.spring.torque",
        estimated="observer.spring.torque",
        current="controller.motor.current",
    )
    difference = run["plant.spring.torque"] - np.interp(run.time, whole.time, whole["plant.spring.torque"])
    return [
        nls.report.Chapter("Co-simulation", "Plant, observer and torque controller as FMUs, wired by name."),
        nls.report.FigureSection(
            "Closed torque loop",
            nls.figures.closed_loop(loop, differences={"true torque": difference}),
            caption="0.8 N·m at 1 Hz; the controller has one sample to compute.",
            means=f"The same loop simulated in one piece differs by at most "
            f"{results['cosimulation_difference_Nm']:.1e} N·m.",
        ),
    ]


def file_pages(done: dict[str, Any]) -> list[Any]:
    """List what was written."""
    out: Path = done["out"]
    source = done["source"]
    files = {
        out / "actuator.toml": "deck of the actuator",
        out / "designed.toml": "deck of the designed actuator",
        out / "diagnosis" / "model.toml": "deck of the refitted actuator with the missing effect",
        source.header: "observer in C99, interface",
        source.source: "observer in C99",
        source.selftest: "self-test with vectors",
        **{path: "co-simulation FMU" for path in done["fmus"]},
        **{path: "drawing of the cam" for path in sorted((out / "drawing").iterdir())},
    }
    return [nls.report.Chapter("Files"), nls.report.FileSection("Written beside this page", files)]
