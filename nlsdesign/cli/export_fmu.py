"""``nlsdesign export fmu``: plant, observer, controller, and both in one step, as FMUs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import NlsError
from .controller import controller_of, law_options
from .observer import sample_time_option
from .observer_kinds import kind_option
from .output import deck_option, examples, json_option, measured_option, show_written, spring_option
from .overwriting import out_option
from .range_remarks import range_remarks, warn

if TYPE_CHECKING:
    from ..export import Authorship
    from ..model.flat import FlatModel

FILES = {
    "plant": "plant",
    "observer": "observer",
    "controller": "controller",
    "both": "observer_and_controller",
}
"""Name of the file, without its ending, by what is exported."""


class _Models:
    """The models of a deck, each designed once and only when it is asked for."""

    def __init__(
        self, plant: FlatModel, sample_time: float, chosen: dict[str, Any], law: dict[str, Any]
    ) -> None:
        self.plant, self.sample_time, self.chosen, self.law = plant, sample_time, chosen, law
        self._made: dict[str, FlatModel] = {"plant": plant}

    def __getitem__(self, what: str) -> FlatModel:
        if what not in self._made:
            makers: dict[str, Callable[[], FlatModel]] = {
                "observer": self._observer,
                "controller": self._controller,
                "both": self._both,
            }
            self._made[what] = makers[what]()
        return self._made[what]

    def _observer(self) -> FlatModel:
        from ..feedback.observer import designed_observer

        return designed_observer(self.plant, sample_time=self.sample_time, **self.chosen).model

    def _controller(self) -> FlatModel:
        return controller_of(self.plant, self.sample_time, **self.law)

    def _both(self) -> FlatModel:
        from ..feedback.control import joined

        return joined(self["observer"], self["controller"])

    def only(self, what: Sequence[str]) -> tuple[dict[str, FlatModel], dict[str, str]]:
        """Return what is asked for; nothing is left out."""
        return {each: self[each] for each in dict.fromkeys(what)}, {}

    def possible(self) -> tuple[dict[str, FlatModel], dict[str, str]]:
        """Return what this deck allows, and why the rest is left out."""
        models: dict[str, FlatModel] = {"plant": self.plant}
        reasons: dict[str, str] = {}
        for what in ("observer", "controller", "both"):
            try:
                models[what] = self[what]
            except NlsError as error:  # not every machine has one; the reason is printed
                reasons[what] = str(error)
        return models, reasons


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


@click.command(
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
    """Write plant, torque observer, torque controller, and observer with controller in one, as FMUs."""
    from ..components.assembly.deck_writer import declare
    from ..export import Authorship
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps
    from ..model import flatten

    chosen = {name: others[name] for name in ("kind", "spring", "measured")}
    law = {name: others[name] for name in ("law", "bandwidth", "velocity_bandwidth")}
    declared = declare(load_deck(deck_name))
    made, steps = _Models(flatten(declared), sample_time, chosen, law), Steps()
    # Before anything is written: not every system has an observer.
    with steps.step("models"):
        models, reasons = made.only(what) if what else made.possible()
    about = Authorship(others["author"], others["copyright_"], others["licence"], date=others["date"])
    with steps.step("FMUs"):
        written = _write(models, out, others["version"], _systems(platforms), about)
    if others["reference"]:
        from ..export import write_reference

        written += [
            file for name in models for file in write_reference(models[name], out / f"{FILES[name]}.fmu")
        ]
    show_written(as_json, (), written, left_out=reasons)
    for name, reason in {} if as_json else reasons.items():
        click.echo(f"left out: {name}: {reason}")
    warn(range_remarks(declared, measured=chosen["measured"]))


def _systems(platforms: Sequence[str]) -> Sequence[str] | None:
    from ..export import ALL_PLATFORMS

    return (ALL_PLATFORMS if "all" in platforms else platforms) or None


def _write(
    models: dict[str, FlatModel],
    out: Path,
    version: str,
    systems: Sequence[str] | None,
    about: Authorship,
) -> list[Path]:
    from ..export import export_fmu

    dated = about.dated()
    return [
        export_fmu(model, out / f"{FILES[name]}.fmu", version=version, platforms=systems, authorship=dated)
        for name, model in models.items()
    ]
