"""``nlsdesign observer --errors``: torque errors with exact numbers, over the spread, and by cause."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import ArrangementError
from ..foundation.prefixes import shared_prefix, without_power
from ..foundation.quantity import typeset_unit
from .observer_kinds import CASCADE, DesignedObserver, designed_observer
from .output import next_command, show_table

if TYPE_CHECKING:
    from ..feedback.observer import SpreadErrors
    from ..model import FlatModel

CAUSES = 8
"""Rows of the table of causes."""


def spread_errors(
    plant: FlatModel,
    chosen: DesignedObserver,
    *,
    draws: int,
    sample_time: float,
    spring: str | None = None,
    measured: str | None = None,
) -> SpreadErrors:
    """Run the chosen observer, the cascade and the published form on one bench, over the deck's spread."""
    from ..export import quickest
    from ..feedback.observer import observer_bench, observer_errors
    from ..feedback.observer.adaptive.adaptive_observer import encoder_quantum
    from ..model.roles import measured_motion, series_spring

    if not any(v.spread > 0.0 for v in plant.parameters):
        raise ArrangementError(
            f"model '{plant.name}'", "declares no spread, so there are no errors over it",
            next_step="give numbers a spread, or leave out --errors",
        )  # fmt: skip
    torque, measured = series_spring(plant, spring).effort, measured_motion(plant, measured)
    observers = {chosen.kind: chosen.design.model}
    for kind in (CASCADE, "published"):
        if kind not in observers:
            other = designed_observer(
                plant, kind=kind, sample_time=sample_time, spring=spring, measured=measured
            )
            observers[kind] = other.design.model
    bench = observer_bench(plant, estimate=torque, measured=measured, sample_time=sample_time)
    try:
        encoder_quantum(plant, measured)
        bounded = 2
    except ArrangementError:
        # What no estimator can do better depends on the counts; without an encoder it is not computed.
        bounded = 0
    return observer_errors(observers, bench, draws=draws, bounded=bounded, translate=quickest())


def write_errors(
    errors: SpreadErrors, out: Path, *, model: FlatModel, words: Sequence[str], files: Sequence[Path]
) -> list[Path]:
    """Write the errors as table, JSON, figure and page.

    ``files``: written before; the page lists them too.
    """
    from ..foundation.writing import write_table, write_text
    from ..presentation import figures
    from ..presentation.report import write_observer_report

    numbers = ("exact", "median", "quantile 90 %", "rms", "bound")
    heads = ["observer", "frequency [Hz]", *(f"{name} [{errors.unit}]" for name in numbers)]
    rows = [
        [name, f"{f:g}", *(f"{v:.9g}" for v in values), "" if bound is None else f"{bound:.9g}"]
        for name, f, *values, bound in _rows(errors)
    ]
    text = json.dumps(content_of(errors), indent=2, ensure_ascii=False) + "\n"
    write_table(out / "errors.csv", [heads, *rows])
    write_text(out / "errors.json", text)
    drawn = figures.write_figures(out, {"errors": figures.errors_over_spread(errors)})
    written = [out / "errors.csv", out / "errors.json", *drawn]
    page = out / "report.html"
    return [*written, write_observer_report(page, model, errors, words=words, files=[*files, *written])]


def _rows(errors: SpreadErrors) -> list[tuple[Any, ...]]:
    return [
        (
            name, f, float(errors.exact[i, k]), float(errors.quantile(name, 0.5)[k]),
            float(errors.quantile(name, 0.9)[k]), float(errors.rms(name)[k]),
            float(errors.bound[k]) if len(errors.bound) else None,
        )
        for i, name in enumerate(errors.observers)
        for k, f in enumerate(errors.frequencies)
    ]  # fmt: skip


def content_of(errors: SpreadErrors) -> dict[str, Any]:
    """Return the errors as JSON holds them."""
    keys = ("observer", "frequency_Hz", "exact", "median", "quantile_90", "rms", "bound")
    return {
        "unit": errors.unit,
        "amplitude": errors.torque,
        "draws": int(errors.drawn.shape[1]),
        "draws_that_did_not_run": errors.lost,
        "errors": [dict(zip(keys, row, strict=True)) for row in _rows(errors)],
        "causes": {name: dict(errors.ranked_causes(name)) for name in errors.observers},
        "least_over_the_spread": errors.best,
    }


def show_errors(errors: SpreadErrors, kind: str, deck_name: str) -> None:
    """Print both tables, and where the way goes on."""
    unit, causes = typeset_unit(errors.unit), errors.ranked_causes(kind)[:CAUSES]
    factor, shown = shared_prefix([size for _, size in causes], errors.unit)
    title = (
        f"Torque error in {errors.shown_in} rms, sines of {errors.torque:.3g} {unit}, "
        f"{errors.drawn.shape[1]} draws of the spread"
    )
    heads = ("observer", "Hz", "exact numbers", "median", "90 %", "rms", "bound on rms")
    show_table(title, heads, errors.rows())
    ranked = [[name, without_power(factor * size)] for name, size in causes]
    show_table("Causes", (f"{kind}: cause, one standard deviation off", f"{shown} rms"), ranked)
    if errors.lost:
        click.echo(f"{errors.lost} drawn machines do not run and are in no figure")
    if len(errors.bound):
        click.echo(
            "the bound is on the rms over all machines within the spread, for any estimator with these "
            "sensors; a few draws scatter about it"
        )
    click.echo(f"least over the spread: {errors.best}")
    following = next_command("observer", "calibrate", "--deck", deck_name, "--plan")
    click.echo(f"what a calibration would buy: {following}")
