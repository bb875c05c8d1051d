"""``nlsdesign export fmu``: plant, observer, controller, and both in one step, as FMUs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import NlsError
from .export import export
from .options import (
    controller_of,
    deck_option,
    json_option,
    kind_option,
    law_options,
    machine_of,
    measured_option,
    sample_time_option,
    spring_option,
)
from .output import examples, show_written, warn
from .overwriting import out_option

if TYPE_CHECKING:
    from ..model import FlatModel

FILES = {
    "plant": "plant",
    "observer": "observer",
    "controller": "controller",
    "both": "observer_and_controller",
}
"""Name of the file, without its ending, by what is exported."""


def _date(_context: click.Context, _parameter: click.Parameter, text: str | None) -> datetime | None:
    if text is None:
        return None
    try:
        date = datetime.fromisoformat(text)
    except ValueError:
        raise click.BadParameter(f"'{text}' is no date such as 2026-03-04T12:00:00+00:00") from None
    if date.tzinfo is None:
        raise click.BadParameter(f"'{text}' has no time zone; write it as {text}+00:00 or {text}Z")
    return date


def _writes(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files that the options ask for."""
    stems = [FILES[each] for each in given["what"] or FILES]
    further = ("_ref.csv", "_ref.opt", "_in.csv") if given["reference"] else ()
    return [f"{stem}{ending}" for stem in stems for ending in (".fmu", *further)]


@export.command(
    "fmu",
    epilog=examples(
        "nlsdesign export fmu --deck austin2015_figure_consistent --what plant",
        "nlsdesign export fmu --deck austin2015_figure_consistent --platform all --version 2.0 --licence MIT",
    ),
)
@deck_option
@click.option(
    "--what",
    multiple=True,
    type=click.Choice(list(FILES)),
    help="What to write; by default all that the deck allows. `both` is observer and controller as one step. "
    "Repeatable.",
)
@kind_option
@law_options
@sample_time_option
@spring_option
@measured_option
@out_option("out/fmu", writes=_writes)
@click.option(
    "--version", type=click.Choice(["2.0", "3.0"]), default="3.0", show_default=True, help="FMI version."
)
@click.option(
    "--platform",
    "platforms",
    multiple=True,
    help="For instance x86_64-windows, or `all`; this machine by default; repeatable.",
)
@click.option("--reference", is_flag=True, help="Write reference results beside each FMU.")
@click.option("--author", default="", help="Of the model.")
@click.option("--copyright", "copyright_", default="", help="Notice of copyright.")
@click.option("--licence", default="", help="Licence of the model.")
@click.option(
    "--date",
    callback=_date,
    help="Of the export, as 2026-03-04T12:00:00Z; by default SOURCE_DATE_EPOCH or now.",
)
@json_option
def export_fmus(
    deck_name: str,
    sample_time: float,
    out: Path,
    what: tuple[str, ...],
    platforms: tuple[str, ...],
    as_json: bool,
    **others: Any,
) -> None:
    """Write plant, observer, controller as FMUs. Also observer with controller in one."""
    from ..export import ALL_PLATFORMS, Authorship, export_fmu, write_reference
    from ..foundation.progress import Steps
    from ..model import flatten
    from ..regeneration import range_remarks

    declared, steps = machine_of(deck_name), Steps()
    # Before anything is written: not every system has an observer.
    with steps.step("models"):
        models, reasons, sentences = _models(flatten(declared), what, sample_time, others)
    about = Authorship(others["author"], others["copyright_"], others["licence"], date=others["date"]).dated()
    systems, version = (ALL_PLATFORMS if "all" in platforms else platforms) or None, others["version"]
    with steps.step("FMUs"):
        written = [
            export_fmu(
                model, out / f"{FILES[name]}.fmu", version=version, platforms=systems, authorship=about
            )
            for name, model in models.items()
        ]
    if others["reference"]:
        written += [
            file for name in models for file in write_reference(models[name], out / f"{FILES[name]}.fmu")
        ]
    show_written(as_json, sentences, written, left_out=reasons)
    for name, reason in {} if as_json else reasons.items():
        click.echo(f"left out: {name}: {reason}")
    warn(range_remarks(declared, measured=others["measured"]))


def _models(
    plant: FlatModel, what: Sequence[str], sample_time: float, chosen: Mapping[str, Any]
) -> tuple[dict[str, FlatModel], dict[str, str], list[str]]:
    """Return what is asked for; if nothing is, what this deck allows, and why the rest is left out.

    Also in a sentence which margins a controller has.
    """
    from ..feedback.control import joined
    from ..feedback.observer import designed_observer

    sentences: list[str] = []

    @cache
    def observer() -> FlatModel:
        roles = {name: chosen[name] for name in ("kind", "spring", "measured")}
        return designed_observer(plant, sample_time=sample_time, **roles).model

    @cache
    def controller() -> FlatModel:
        law = {name: chosen[name] for name in ("law", "bandwidth", "velocity_bandwidth")}
        made, margins = controller_of(plant, sample_time, **law)
        sentences.append(margins)
        return made

    makers: dict[str, Callable[[], FlatModel]] = {
        "plant": lambda: plant,
        "observer": observer,
        "controller": controller,
        "both": lambda: joined(observer(), controller()),
    }
    if what:
        return {name: makers[name]() for name in dict.fromkeys(what)}, {}, sentences
    models: dict[str, FlatModel] = {}
    reasons: dict[str, str] = {}
    for name, make in makers.items():
        try:
            models[name] = make()
        except NlsError as error:  # not every machine has one; the reason is printed
            reasons[name] = str(error)
    return models, reasons, sentences
