"""``nlsdesign export block`` and ``export a2l``: other numbers for exported code, without compiling it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .export import export
from .options import DECK_HELP, controller_of, json_option
from .output import examples, show_written
from .overwriting import out_file_option, out_option
from .typed_values import NamedPath

if TYPE_CHECKING:
    from ..components import Assembly
    from ..export import ParameterBlock
    from ..model import FlatModel

FORMS = (".bin", ".c", ".json")
_EXAMPLE = "out/c/torque_loop_block.json"
_code = click.option(
    "--code", "code", required=True, type=NamedPath(dir_okay=False, example=_EXAMPLE),
    help="NAME_block.json that export c --block has written beside the code.",
)  # fmt: skip


def block_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--code``: code for which the better deck is written as a block too."""
    return click.option(
        "--code", "code", default=None, type=NamedPath(dir_okay=False, example=_EXAMPLE),
        help="NAME_block.json of exported code: also write the numbers of the better deck as a block for it.",
    )(command)  # fmt: skip


def block_of(code: Path, deck: Assembly) -> ParameterBlock:
    """Return the block with which exported code computes what it would if exported from another deck."""
    from ..export import read_parameter_block
    from ..regeneration import block_for

    read = read_parameter_block(code)
    law = dict(read.recipe.get("law", {}))

    def controller(plant: FlatModel) -> FlatModel:
        return controller_of(plant, float(read.recipe["sample_time"]), **law)[0]

    return block_for(read, deck, controller)


def write_forms(block: ParameterBlock, out: Path) -> list[Path]:
    """Write a block in all forms; return the files."""
    from ..export import write_parameter_block

    return [write_parameter_block(block, out / f"{block.layout.name}_numbers{form}") for form in FORMS]


def written_block(code: Path | None, deck: Assembly, out: Path) -> tuple[list[Path], tuple[str, ...]]:
    """Write the block of a better deck where code was named; return the files, and why there is none.

    The deck stands in its file already, whatever happens to the block.
    """
    from ..foundation.errors import NlsError

    if code is None:
        return [], ()
    try:
        return write_forms(block_of(code, deck), out), ()
    except NlsError as error:
        return [], (f"no block is written for {code}: {error}",)


def _writes(given: Mapping[str, Any]) -> list[str]:
    name = Path(given["code"]).name.removesuffix(".json").removesuffix("_block").removesuffix("_numbers")
    return [f"{name}_numbers{form}" for form in FORMS]


@export.command(
    "block",
    epilog=examples(
        "nlsdesign export block --code out/c/torque_loop_block.json --deck better.toml",
        "nlsdesign export block --code out/c/torque_loop_block.json --value controller.bandwidth=9",
    ),
)
@_code
@click.option(
    "--deck", "deck_name", default=None, metavar="DECK", help=f"Deck with other numbers. {DECK_HELP}"
)
@click.option("--value", "values", multiple=True, metavar="NAME=NUMBER",
              help="Parameter of the block in SI, as the JSON names it; repeatable.")  # fmt: skip
@out_option("out/block", writes=_writes)
@json_option
def export_block(
    code: Path, deck_name: str | None, values: tuple[str, ...], out: Path, as_json: bool
) -> None:
    """Write other numbers for exported code, as bytes, C and JSON. The code takes them at run time.

    With --deck they are what the code would have if it were exported from that deck. What the code cannot
    take is refused with its reason.
    """
    from ..components import declare
    from ..export import read_parameter_block
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps

    given = dict(map(named_number, values))
    if deck_name is None:
        block = read_parameter_block(code)
    else:
        with Steps().step("block"):
            block = block_of(code, declare(load_deck(deck_name)))
    block = block.with_values(given)
    design = block.layout.default.values
    moved = sum(1 for name, value in block.values.items() if value != design[name])
    words = (
        f"block of {block.deck} for {block.layout.name} of {block.layout.deck}: {block.layout.size} B, "
        f"{moved} of {len(block.values)} numbers differ from those of {code.name}, checksum "
        f"0x{block.checksum:08x}",
    )
    files = write_forms(block, out)
    show_written(as_json, words, files, digest=block.layout.digest, checksum=f"0x{block.checksum:08x}")


def named_number(text: str) -> tuple[str, float]:
    """Return name and number of NAME=NUMBER."""
    name, _, number = text.partition("=")
    try:
        return name.strip(), float(number)
    except ValueError:
        raise click.BadParameter(f"'{text}' is not NAME=NUMBER, such as controller.bandwidth=9") from None


@export.command(
    "a2l",
    epilog=examples(
        "nlsdesign export a2l --code out/c/torque_loop_block.json --out joint.a2l",
        "nlsdesign export a2l --code out/c/torque_loop_block.json --elf firmware.elf --block-symbol my_block "
        "--out joint.a2l",
    ),
)
@_code
@click.option("--elf", default=None, type=NamedPath(dir_okay=False, example="firmware.elf"),
              help="Linked program with both symbols, for their addresses; else they are 0.")  # fmt: skip
@click.option("--block-symbol", "block", default="block", show_default=True, metavar="NAME",
              help="Variable of the program that is the block, in memory that can be written.")  # fmt: skip
@click.option("--instance-symbol", "instance", default="state", show_default=True, metavar="NAME",
              help="Variable of the program that is the instance of the code.")  # fmt: skip
@out_file_option("out/block.a2l", "File to write, NAME.a2l.", ending=".a2l")
@json_option
def export_description(
    code: Path, elf: Path | None, block: str, instance: str, out: Path, as_json: bool
) -> None:
    """Describe blocks and signals of exported code as A2L. XCP tools read it."""
    from ..export import read_parameter_block, write_a2l

    layout = read_parameter_block(code).layout
    words = () if elf else ("addresses are 0: give --elf, or let the tool follow the symbol links",)
    show_written(as_json, words, [write_a2l(layout, out, block=block, instance=instance, elf=elf)])
