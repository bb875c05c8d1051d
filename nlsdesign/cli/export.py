"""``nlsdesign export``: C code, Modelica text, MuJoCo models; and whether files belong together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from .options import (
    DECK_HELP,
    controller_of,
    deck_option,
    flash_options,
    json_option,
    kind_option,
    law_options,
    machine_of,
    measured_option,
    real_option,
    sample_time_option,
    spring_option,
)
from .output import examples, show_json, show_lines, show_table, show_written, warn
from .overwriting import c_names, out_file_option, out_option
from .typed_values import NamedPath
from .watch import WATCH, export_monitor

if TYPE_CHECKING:
    from ..components import Assembly
    from ..export import CSource
    from ..feedback.observer import DesignedObserver
    from ..model import FlatModel

_LAW = ("law", "bandwidth", "velocity_bandwidth")
OBSERVER, CONTROLLER, BOTH = "observer", "controller", "both"


@click.group()
def export() -> None:
    """Write C code, FMUs, Modelica text or MuJoCo models."""


def _writes(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files that the options ask for."""
    name = "torque_loop" if given["what"] == BOTH else given["what"]
    if name == WATCH:
        return [*c_names(name), *c_names(f"{name}_residuals"), f"{name}.a2l"]
    further = (
        (
            ".hpp",
            "_supervisor.h",
            "_example_posix.c",
            "_example_cortex_m.c",
            "_link.h",
            "_example_link.c",
            "_play.py",
            ".mk",
            ".gdb",
        )
        if given["examples"]
        else ()
    )
    build = ["CMakeLists.txt"] if further else []
    blocks = [f"{name}_block.json"] if given["with_block"] else []
    packed = [f"{name}_library/library.json"] if given["package"] else []
    return [*c_names(name), *(f"{name}{ending}" for ending in further), *build, *blocks, *packed]


@export.command(
    "c",
    epilog=examples(
        "nlsdesign export c --deck austin2015_figure_consistent",
        "nlsdesign export c --deck austin2015_figure_consistent --what both --real float --flash 64kB "
        "--examples",
        "nlsdesign export c --deck my.toml --what controller --law pid --dry-run",
        "nlsdesign export c --deck austin2015_figure_consistent --what watch --real float",
    ),
)
@deck_option
@click.option(
    "--what",
    type=click.Choice([OBSERVER, CONTROLLER, BOTH, WATCH]),
    default=OBSERVER,
    show_default=True,
    help="both: observer and torque controller as one step, which keeps the current itself. "
    "watch: a monitor that says in use when the deck no longer holds.",
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
@click.option(
    "--package", is_flag=True, help="Also write it as a library for PlatformIO, Arduino, Zephyr, CMake."
)
@click.option(
    "--prove", is_flag=True, help="Prove with Frama-C: nothing undefined, all finite, for all inputs."
)
@click.option("--block", "with_block", is_flag=True, help="The code takes blocks of other numbers while it "
              "runs; NAME_block.json tells `export block` how to make them.")  # fmt: skip
@json_option
def export_code(
    deck_name: str, what: str, sample_time: float, out: Path, real: str, as_json: bool, **chosen: Any
) -> None:
    """Write observer, controller or both as C99 with a self-test. Both together are one step.

    The observer is by default the one that is best over the spread of the deck.
    """
    if what == WATCH:
        export_monitor(deck_name, sample_time, out, real, as_json, chosen)
        return
    from ..export import export_c, prove_step, write_examples, write_package
    from ..foundation.progress import Steps
    from ..model import flatten
    from ..regeneration import range_remarks, require_time

    declared = machine_of(deck_name)
    plant = flatten(declared)
    with_examples, with_block = chosen.pop("examples"), chosen.pop("with_block")
    packed, proved, budget = chosen.pop("package"), chosen.pop("prove"), chosen.pop("budget")
    with Steps().step(what):
        part = sampled_part(plant, what, sample_time, {**chosen, "real": real})
    name, model, sentences = part.name, part.model, part.sentences
    if budget:
        sentences = (*sentences, require_time(model, real, share=budget[0], clock=budget[1]))
    if with_block:
        options = {**chosen, "what": what, "sample_time": sample_time, "real": real}
        source, file, size = code_with_blocks(part, declared, out, options)
        words = (
            f"a block has {size} B, an instance keeps its own copy; the flash above is that without blocks"
        )
        sentences = (*sentences, words)
    else:
        source, file = export_c(model, out, real=real, name=name), None
    written = [source.header, source.source, source.selftest, *([file] if file else [])]
    if with_examples:
        written += write_examples(source)
    if packed:
        written += write_package(source, out / f"{name}_library")
    proof = None
    if proved:
        with Steps().step("proof"):
            proof = prove_step(source)
        sentences = (*sentences, *proof.words())
    remarks = range_remarks(declared, measured=chosen["measured"])
    warn(remarks)
    show_written(as_json, (model.description, *sentences), written, name=name, warnings=remarks)
    if proof is not None and not proof.holds:
        raise click.exceptions.Exit(1)


class SampledPart(NamedTuple):
    """What a controller runs, the name of its files, what is to be known of its size, and its observer."""

    name: str
    model: FlatModel
    sentences: tuple[str, ...]
    designed: DesignedObserver | None = None


def code_with_blocks(
    part: SampledPart, declared: Assembly, out: Path, chosen: Mapping[str, Any]
) -> tuple[CSource, Path, int]:
    """Write code that takes blocks; return its files, that of the block of its design, and its bytes."""
    from ..components import deck_text
    from ..export import export_c_with_blocks, write_parameter_block
    from ..model import flatten
    from ..regeneration import CodeRecipe, SameTable

    law = {name: chosen[name] for name in _LAW}
    designed = part.designed
    recipe = CodeRecipe(
        what=chosen["what"], kind=designed.kind if designed else None, sample_time=chosen["sample_time"],
        spring=chosen["spring"], measured=chosen["measured"],
        table=SameTable.of(designed.design.compact) if designed else None, law=law, deck=deck_text(declared),
    )  # fmt: skip
    loadable = recipe.loadable(
        flatten(declared), lambda plant: controller_of(plant, chosen["sample_time"], **law)[0]
    )
    source, layout = export_c_with_blocks(loadable, out, real=chosen["real"], name=part.name)
    block = replace(layout.default, recipe=recipe.to_dict())
    return source, write_parameter_block(block, out / f"{part.name}_block.json"), layout.size


def sampled_part(plant: FlatModel, what: str, sample_time: float, chosen: Mapping[str, Any]) -> SampledPart:
    """Return what a controller runs."""
    from ..feedback.control import joined
    from ..regeneration import require_flash, sized_observer

    law = {name: chosen[name] for name in _LAW}
    others = {name: value for name, value in chosen.items() if name not in law}
    if what == CONTROLLER:
        if chosen["table_error"] is not None:
            raise click.BadParameter("--table-error is of an observer; leave it out, or take --what both")
        controller, margins = controller_of(plant, sample_time, **law)
        flash = require_flash(controller, chosen["real"], chosen["flash"])
        return SampledPart(CONTROLLER, controller, (flash, margins))
    if what == OBSERVER:
        sized = sized_observer(plant, sample_time, **others)
        return SampledPart(OBSERVER, sized.designed.model, sized.findings(), sized.designed)
    controller, margins = controller_of(plant, sample_time, **law)
    sized = sized_observer(
        plant, sample_time, part_of=lambda observer: joined(observer, controller), **others
    )
    whole = joined(sized.designed.model, controller)
    return SampledPart("torque_loop", whole, (*sized.findings(), margins), sized.designed)


@export.command(
    "controller",
    epilog=examples(
        "nlsdesign export controller --deck austin2015_figure_consistent",
        "nlsdesign export controller --deck my.toml --law scheduled --bandwidth '8 Hz' --fmu",
    ),
)
@deck_option
@law_options
@sample_time_option
@out_option(
    "out/controller",
    writes=lambda given: [*c_names("controller"), *(["controller.fmu"] if given["fmu"] else [])],
)
@real_option
@click.option("--fmu", is_flag=True, help="Write an FMU for co-simulation (FMI 3.0) beside the C code.")
@json_option
def export_controller(
    deck_name: str, sample_time: float, out: Path, real: str, fmu: bool, as_json: bool, **chosen: Any
) -> None:
    """Write the torque controller as C99 with a self-test."""
    from ..export import export_c, export_fmu
    from ..feedback.control import largest_torque
    from ..model import flatten
    from ..regeneration import range_remarks

    declared = machine_of(deck_name)
    plant = flatten(declared)
    model, margins = controller_of(plant, sample_time, **chosen)
    most = largest_torque(plant)
    source = export_c(model, out, real=real, name="controller")
    written = [source.header, source.source, source.selftest]
    if fmu:
        written.append(export_fmu(model, out / "controller.fmu"))
    sentences = (str(model), margins, f"largest torque that the drive can hold: {most:.4g} N·m")
    remarks = range_remarks(declared)
    warn(remarks)
    show_written(as_json, sentences, written, largest_torque=most, warnings=remarks)


@export.command(
    "modelica",
    epilog=examples(
        "nlsdesign export modelica --deck austin2015_figure_consistent --out plant.mo",
        "nlsdesign export modelica --deck own.toml --smooth --output motor.angle --out plant.mo",
    ),
)
@deck_option
@out_file_option(None, "File to write, NAME.mo.", ending=".mo")
@click.option("--smooth", is_flag=True, help="Round what is sharp: dry friction creeps, stops are soft.")
@click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="NAME",
    help="State or signal that becomes an output, in place of the readings of the sensors; repeatable.",
)
@json_option
def export_modelica_text(
    deck_name: str, out: Path, smooth: bool, outputs: tuple[str, ...], as_json: bool
) -> None:
    """Write the plant as one flat Modelica class. It has units, values and sources.

    Names are those of the deck between quotation marks, such as 'motor.angle'.
    """
    from ..components import smoothed
    from ..export import export_modelica
    from ..model import flatten

    assembly = machine_of(deck_name)
    model = flatten(smoothed(assembly) if smooth else assembly, outputs=list(outputs) or None)
    show_written(as_json, (), [export_modelica(model, out)])


@export.command(
    "mujoco",
    epilog=examples(
        "nlsdesign export mujoco --deck austin2015_figure_consistent",
        "nlsdesign export mujoco --deck my.toml --smooth --out out/joint",
    ),
)
@deck_option
@click.option("--smooth", is_flag=True, help="Round what is sharp: dry friction creeps, stops are soft.")
@out_option("out/mujoco")
@json_option
def export_for_mujoco(deck_name: str, smooth: bool, out: Path, as_json: bool) -> None:
    """Write the plant as MJCF with a plug-in for its laws. A Python module tries both out."""
    from ..components import smoothed
    from ..export import export_mujoco
    from ..model import flatten

    assembly = machine_of(deck_name)
    written = export_mujoco(flatten(smoothed(assembly) if smooth else assembly), out)
    show_written(as_json, (f"next: python {written.module}",), written.files)


@export.command(
    "urdf",
    epilog=examples(
        "nlsdesign export urdf --deck austin2015_figure_consistent",
        "nlsdesign export urdf --deck my.toml --out robot/joint.urdf",
    ),
)
@deck_option
@out_file_option("out/actuator.urdf", "File to write, NAME.urdf.", ending=".urdf")
@json_option
def export_description_of_robot(deck_name: str, out: Path, as_json: bool) -> None:
    """Write inertias, limits and transmissions as URDF. Springs and friction have no place in it."""
    from ..export import export_urdf
    from ..model import flatten

    show_written(as_json, (), [export_urdf(flatten(machine_of(deck_name)), out)])


TOGETHER, APART, UNREADABLE = 0, 1, 2
"""Exit status."""


@export.command(
    "check",
    epilog=examples(
        "nlsdesign export check out/fmu",
        "nlsdesign export check out/c --deck austin2015_figure_consistent --json",
    ),
)
@click.argument("folder", type=NamedPath(example="out/c"))
@click.option("--deck", "deck_name", default=None, metavar="DECK", help=DECK_HELP)
@json_option
def check_exports(folder: Path, deck_name: str | None, as_json: bool) -> int:
    """Say whether exported files belong together, and to a deck. C, Modelica, FMUs, decks in a folder.

    Exit status 0 if all do and none was edited, 1 if not, 2 if a file cannot be read.
    """
    from ..components import deck_digest
    from ..export import read_exports

    exports = read_exports(folder, reference=deck_digest(machine_of(deck_name)) if deck_name else "")
    status = UNREADABLE if exports.problems else TOGETHER if exports.together else APART
    judged = [(str(file.path.relative_to(folder)), file, why)
              for file, why in zip(exports.files, exports.apart, strict=True)]  # fmt: skip
    if as_json:
        rows = [{**asdict(file), "path": path, "belongs": not why, "why": why} for path, file, why in judged]
        show_json({"folder": folder, "deck": exports.reference, "status": status,
                   "together": exports.together, "files": rows,
                   "unreadable": [str(problem) for problem in exports.problems]})  # fmt: skip
        return status
    if judged:
        show_table(
            str(folder),
            ("file", "kind", "deck", "digest", "state"),
            [(path, file.kind, file.deck, file.short, why or "belongs") for path, file, why in judged],
        )
    show_lines(exports.findings())
    return status
