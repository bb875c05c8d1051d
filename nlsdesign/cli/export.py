"""``nlsdesign export``: C code, FMUs and Modelica text."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .controller import controller_of, export_controller, law_options
from .export_check import check_exports
from .export_fmu import export_fmus
from .export_modelica import export_modelica_text
from .flash import controller_size, flash_options, sized_observer
from .observer import real_option, sample_time_option
from .observer_kinds import kind_option
from .output import deck_option, examples, json_option, measured_option, show_written, spring_option
from .overwriting import c_names, out_option
from .range_remarks import range_remarks, warn

if TYPE_CHECKING:
    from ..model import FlatModel

OBSERVER, CONTROLLER, BOTH = "observer", "controller", "both"


@click.group()
def export() -> None:
    """Write C code, FMUs or Modelica text."""


export.add_command(export_controller)
export.add_command(export_fmus)
export.add_command(export_modelica_text)
export.add_command(check_exports)


def _writes(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files that the options ask for."""
    name = "torque_loop" if given["what"] == BOTH else given["what"]
    further = (".hpp", "_example_posix.c", "_example_cortex_m.c", ".mk") if given["examples"] else ()
    build = ["CMakeLists.txt"] if further else []
    return [*c_names(name), *(f"{name}{ending}" for ending in further), *build]


@export.command(
    "c",
    epilog=examples(
        "nlsdesign export c --deck austin2015_figure_consistent",
        "nlsdesign export c --deck austin2015_figure_consistent --what both --real float --flash 64kB "
        "--examples",
        "nlsdesign export c --deck my.toml --what controller --law pid --dry-run",
    ),
)
@deck_option
@click.option(
    "--what",
    type=click.Choice([OBSERVER, CONTROLLER, BOTH]),
    default=OBSERVER,
    show_default=True,
    help="both: observer and torque controller as one step, which keeps the current itself.",
)
@kind_option
@law_options
@sample_time_option
@spring_option
@measured_option
@out_option("out/c", writes=_writes)
@real_option
@flash_options
@click.option("--examples", is_flag=True, help="Write main programs, a C++ class and build files beside it.")
@json_option
def export_code(
    deck_name: str, what: str, sample_time: float, out: Path, real: str, as_json: bool, **chosen: Any
) -> None:
    """Write the torque observer, the torque controller, or both as one step, as C99 with a self-test.

    The observer is by default the one that is best over the spread of the deck.
    """
    from ..components.assembly.deck_writer import declare
    from ..export import export_c, write_examples
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps
    from ..model import flatten

    declared = declare(load_deck(deck_name))
    plant = flatten(declared)
    with_examples = chosen.pop("examples")
    with Steps().step(what):
        name, model, sentences = sampled_part(plant, what, sample_time, {**chosen, "real": real})
    source = export_c(model, out, real=real, name=name)
    written = [source.header, source.source, source.selftest]
    if with_examples:
        written += write_examples(source)
    remarks = range_remarks(declared, measured=chosen["measured"])
    warn(remarks)
    show_written(as_json, (model.description, *sentences), written, name=name, warnings=remarks)


def sampled_part(
    plant: FlatModel, what: str, sample_time: float, chosen: Mapping[str, Any]
) -> tuple[str, FlatModel, tuple[str, ...]]:
    """Return what a controller runs, what its files are called, and what is to be known of its size."""
    law = {name: chosen[name] for name in ("law", "bandwidth", "velocity_bandwidth")}
    others = {name: value for name, value in chosen.items() if name not in law}
    if what == CONTROLLER:
        if chosen["table_error"] is not None:
            raise click.BadParameter("--table-error is of an observer; leave it out, or take --what both")
        controller = controller_of(plant, sample_time, **law)
        return CONTROLLER, controller, controller_size(controller, chosen["real"], chosen["flash"])
    if what == OBSERVER:
        sized = sized_observer(plant, sample_time, **others)
        return OBSERVER, sized.designed.model, sized.sentences
    from ..feedback.control import joined

    controller = controller_of(plant, sample_time, **law)
    sized = sized_observer(plant, sample_time, part_of=lambda each: joined(each, controller), **others)
    return "torque_loop", joined(sized.designed.model, controller), sized.sentences
