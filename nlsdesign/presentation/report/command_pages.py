"""Reports that commands write beside their files: fit, diagnosis, run, analysis over the angle, observer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ...bench.discrepancy.reporting.refit import Refit
from ...bench.discrepancy.reporting.verdict import Verdict
from ...feedback.analysis import Chart, RankDrops, SensorRanking
from ...feedback.observer import SpreadErrors
from ...foundation.quantity import three_digits, typeset_unit
from ...foundation.written_numbers import prefixed, shared_prefix, without_power
from ...model import FlatModel
from ...simulation import Trace, signal_sizes
from ..figures import (
    RecordError,
    errors_over_spread,
    gap_bars,
    observability_over_angle,
    stability_over_angle,
    write_figures,
)
from ..figures.over_time import run_over_time
from .diagnosis_sections import ROLES, fitted_table, regeneration_sections, verdict_sections
from .sections import (
    FigureSection,
    FileSection,
    KeyNumber,
    NumbersSection,
    Section,
    TableSection,
    TextSection,
    write_report,
)

if TYPE_CHECKING:
    from ...regeneration import Regeneration


def write_fit_report(path: Path, result: Refit, *, facts: Mapping[str, str], files: Sequence[Path]) -> Path:
    """Write the report on a fit: errors with the declared and the fitted numbers, and the numbers."""
    errors = result.errors()
    keys = tuple(
        KeyNumber(
            f"{e.block}, {ROLES.get(e.role, e.role)}",
            f"{three_digits(e.fitted)} {typeset_unit(e.unit)}",
            f"rms, declared → fitted; noise {three_digits(e.noise_floor)}"
            + ("" if e.relative is None else f"; on average {three_digits(e.relative)} % off"),
            before=three_digits(e.declared),
        )
        for e in errors
    )
    sections: list[Section] = [NumbersSection("Errors", keys)]
    if result.words():
        caption = "What the records do not say, and what is suspect."
        rows = tuple((each,) for each in result.words())
        sections.append(TableSection("Remarks", ("remark",), rows, caption=caption))
    for block in dict.fromkeys(g.block for g in result.gaps):
        gaps = [g for g in result.gaps if g.block == block]
        bars = [RecordError(g.record, g.before, g.after, g.noise_floor, g.role == "held_out") for g in gaps]
        sections.append(
            FigureSection(
                f"Error of each record: {block}",
                gap_bars(bars, unit=gaps[0].unit),
                caption="Root mean square error with the declared numbers (before) and with the fitted ones "
                "(after), filtered alike; the line across is what noise alone leaves.",
                means="Records marked as held out were used by no fit. What stays far above the line is not "
                "a matter of these numbers: ask `nlsdesign diagnose`.",
            )
        )
    sections += fitted_table(result.numbers, "with nothing added")
    sections.append(_files(files))
    return write_report(path, *sections, title=f"{result.actuator.name}: refitted numbers", facts=facts)


def write_analysis_report(
    path: Path,
    chart: Chart,
    drops: RankDrops,
    *,
    model: str,
    ranking: SensorRanking | None,
    files: Sequence[Path] = (),
) -> Path:
    """Write the report on an analysis over the angle: what sensors do not show, poles, further sensors."""
    stiffness = chart["stiffness.slow"]
    low, high = (three_digits(float(end)) for end in (np.min(stiffness), np.max(stiffness)))
    seen = "at every angle" if drops.detectable else "not everywhere"
    keys = (
        KeyNumber("detectable", seen, f"from {' and '.join(drops.measured)}"),
        KeyNumber("stiffness at rest", f"{low} to {high} N·m/rad", "relaxed, over these angles"),
    )
    lines = tuple((line.replace(" -", " −"),) for line in drops.lines())
    sections: list[Section] = [
        NumbersSection("Key numbers", keys),
        TableSection(
            "What the sensors do not show", ("finding",), lines,
            caption="States that do not show at exact angles, why, and whether they decay by themselves.",
        ),
        FigureSection(
            "Observability", observability_over_angle({model: chart}, drops={model: drops}),
            caption="Rank and condition of what the sensors show of the states; a cross is a lost rank.",
        ),
        FigureSection(
            "Poles and stiffness", stability_over_angle({model: chart}),
            caption="Poles of the plant in each of its modes, and its stiffness.",
            means="Sliding: every body moves. Stuck: dry friction holds what it can.",
        ),
    ]  # fmt: skip
    if ranking is not None:
        rows = tuple(tuple(row) for row in ranking.rows())
        heads = tuple(ranking.headings)
        sections.append(
            TableSection("Which sensor would help the torque most", heads, rows, caption=ranking.condition)
        )
    sections.append(_files(files))
    return write_report(path, *sections, title=f"{model}: over the angle", facts={"deck": f"`{model}`"})


def write_observer_report(
    path: Path, model: FlatModel, errors: SpreadErrors, *, words: Sequence[str], files: Sequence[Path]
) -> Path:
    """Write the report on an observer: its torque errors over the spread beside others, and their causes."""
    first, unit = errors.observers[0], typeset_unit(errors.unit)
    causes = errors.ranked_causes(first)
    factor, shown = shared_prefix([size for _, size in causes], errors.unit)
    keys = tuple(
        KeyNumber(
            f"{name}, median over the spread",
            f"{prefixed(float(np.max(errors.quantile(name, 0.5))), errors.unit)} rms",
            f"at the worst of {', '.join(f'{f:g}' for f in errors.frequencies)} Hz; with exact numbers "
            f"{prefixed(float(np.max(exact)), errors.unit)}",
        )
        for name, exact in zip(errors.observers, errors.exact, strict=True)
    )
    heads = ("observer", "Hz", "median", "90 %", "rms", "bound on rms", "exact numbers")
    sections: list[Section] = [
        NumbersSection("Torque error", keys),
        TextSection("The observer", drawing="\n".join(words)),
        FigureSection(
            "Torque errors over the spread", errors_over_spread(errors),
            caption=f"Sines of {three_digits(errors.torque)} {unit}; {errors.drawn.shape[1]} machines drawn "
            "from the spreads of the deck. Dashed: what no estimator with these sensors betters.",
            means="Below: what one standard deviation of each number costs.",
            assumed="Numbers of the deck are independent.",
        ),
        TableSection(
            "Torque errors", heads, tuple(tuple(row) for row in errors.rows()),
            caption=f"In {errors.shown_in}, root mean square.",
        ),
        TableSection(
            f"Causes, {first}", ("number", f"{shown} rms"),
            tuple((name, without_power(factor * size)) for name, size in causes),
            caption="Torque error where one number is off by one standard deviation.", folded=True,
        ),
        _files(files),
    ]  # fmt: skip
    return write_report(path, *sections, title=f"{model.name}: torque observer")


def _files(files: Sequence[Path]) -> FileSection:
    kinds = {".csv": "table", ".json": "numbers for programs", ".svg": "figure", ".toml": "deck", ".c": "C99",
             ".h": "C99, interface", ".fmu": "co-simulation FMU"}  # fmt: skip
    named = {each: kinds.get(each.suffix, "file") for each in files}
    return FileSection("Files", named, caption="Written beside this report.")


def write_diagnosis_report(
    path: Path,
    verdict: Verdict,
    *,
    facts: Mapping[str, str],
    regenerated: tuple[Regeneration, Mapping[Path, str]] | None = None,
    exported: Mapping[Path, str] = MappingProxyType({}),
) -> Path:
    """Write the report on a diagnosis."""
    chapter: list[Section] = []
    if regenerated:
        chapter += regeneration_sections(regenerated[0], {**regenerated[1], **exported})
    elif exported:
        chapter.append(FileSection("Files", exported, caption="Written beside this report."))
    title = f"{verdict.declared.name}: what is missing"
    return write_report(path, *verdict_sections(verdict), *chapter, title=title, facts=facts)


SIZES = ("signal", "smallest", "largest", "rms", "at the end", "unit")
"""Heads of the table of the sizes of signals."""


def write_simulation_report(
    path: Path,
    model: FlatModel,
    run: Trace,
    signals: Sequence[str],
    *,
    facts: Mapping[str, str],
    warnings: Sequence[str] = (),
) -> list[Path]:
    """Write the picture of a run and a page with it; the table of the run stands beside them."""
    picture = run_over_time(run, signals)
    (file,) = write_figures(path.parent, {path.stem: picture})
    sizes: list[tuple[str | float, ...]] = [
        (n, *signal_sizes(run[n]).values(), typeset_unit(run.units[n])) for n in signals
    ]
    sections: list[Section] = [
        TextSection("Warnings", "\n\n".join(warnings) or "No law leaves its range, no limit is reached."),
        FigureSection("Signals over time", picture, caption="Signals of one unit share a panel."),
        TableSection("Sizes", SIZES, tuple(sizes), caption="Over the whole run."),
    ]
    if run.events:
        rows = tuple((f"{event.time:.6g}", event.name, event.what) for event in run.events)
        caption = "What sticks, slides, strikes or switches, and when."
        sections.append(
            TableSection("Events", ("time in s", "part", "what"), rows, caption=caption, folded=True)
        )
    files = {path: "all rows", file: "the picture"}
    sections.append(FileSection("Files", files, caption="Written beside this page."))
    title = f"{model.name}: simulation"
    return [file, write_report(path.with_suffix(".html"), *sections, title=title, facts=facts)]
