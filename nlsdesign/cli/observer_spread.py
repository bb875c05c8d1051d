"""``nlsdesign observer --errors``: torque errors with exact numbers, over the spread, and by cause."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..foundation.quantity import typeset_unit
from ..foundation.written_numbers import shared_prefix, without_power
from .output import next_command, show_table

if TYPE_CHECKING:
    from ..feedback.observer import SpreadErrors
    from ..model import FlatModel

CAUSES = 8
"""Rows of the table of causes."""


def write_errors(
    errors: SpreadErrors, out: Path, *, model: FlatModel, words: Sequence[str], files: Sequence[Path]
) -> list[Path]:
    """Write the errors as table, JSON, figure and page.

    ``files``: written before; the page lists them too.
    """
    from ..presentation import figures
    from ..presentation.report import write_observer_report

    written = [
        *errors.write(out),
        *figures.write_figures(out, {"errors": figures.errors_over_spread(errors)}),
    ]
    page = out / "report.html"
    return [*written, write_observer_report(page, model, errors, words=words, files=[*files, *written])]


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
