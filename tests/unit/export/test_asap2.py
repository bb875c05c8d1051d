"""A2L descriptions: read by a grammar of the standard's keywords, by a2ltool, and against the compiler."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import nlsdesign as nls
from nlsdesign.components import smoothed
from nlsdesign.export import export_watch, write_a2l, write_watch_a2l
from nlsdesign.export.c.asap2 import elf_symbols
from nlsdesign.export.c.writer import paths_in_memory
from nlsdesign.export.compilation.cross_compiler import run_compiler
from nlsdesign.foundation.errors import ExportError
from nlsdesign.regeneration import watch_plan
from tests.blocks import exported
from tests.compiling import compile_program

TOKEN = re.compile(r'/begin\s+\w+|/end\s+\w+|"[^"]*"|[^\s"]+')
IDENTIFIER = r"[A-Za-z_]\w*(\[\d+\])*(\.[A-Za-z_]\w*(\[\d+\])*)*"
# An environment that is not activated has its programs beside its Python, not on the path.
BESIDE = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
READER = shutil.which("a2ltool", path=BESIDE)
TYPES = {"FLOAT32_IEEE": "f", "FLOAT64_IEEE": "d", "ULONG": "I"}


@pytest.fixture(scope="module", params=["float", "double"])
def joint(request, tmp_path_factory):
    """Return the code of the published machine and its description without addresses."""
    folder = tmp_path_factory.mktemp(request.param)
    _, code = exported(folder, request.param)
    return code.layout, write_a2l(code.layout, folder / "joint.a2l"), folder


class Block:
    """One /begin ... /end of ASAP2: its keyword, what stands in it, and the blocks within."""

    def __init__(self, keyword: str) -> None:
        self.keyword, self.items, self.within = keyword, [], []

    def of(self, keyword: str) -> list[Block]:
        return [b for b in self.within if b.keyword == keyword]

    def after(self, keyword: str, count: int) -> list[str]:
        at = self.items.index(keyword)
        return self.items[at + 1 : at + 1 + count]


def parsed(text: str) -> Block:
    """Read a description by the rule of the standard: blocks nest and end with their own keyword."""
    stack = [Block("")]
    for token in TOKEN.findall(text):
        if token.startswith("/begin"):
            stack.append(Block(token.split()[1]))
            stack[-2].within.append(stack[-1])
        elif token.startswith("/end"):
            assert stack.pop().keyword == token.split()[1]
        else:
            stack[-1].items.append(token)
    assert len(stack) == 1
    return stack[0]


def module(path) -> Block:
    whole = parsed(path.read_text())
    assert whole.items[:3] == ["ASAP2_VERSION", "1", "71"]
    (project,) = whole.of("PROJECT")
    (found,) = project.of("MODULE")
    return found


def entries(found: Block) -> dict[str, tuple[str, int, str]]:
    """Return symbol, offset and type of everything that has an address, by name."""
    (number, word) = found.of("RECORD_LAYOUT")
    layouts = {each.items[0]: each.after("FNC_VALUES", 2)[1] for each in (number, word)}
    units = {each.items[0] for each in found.of("COMPU_METHOD")}
    result = {}
    for each in [*found.of("CHARACTERISTIC"), *found.of("MEASUREMENT")]:
        name, text = each.items[:2]
        assert re.fullmatch(IDENTIFIER, name), name
        assert text[0] == text[-1] == '"'
        is_number = each.keyword == "CHARACTERISTIC"
        kind, method, low, high = (
            (layouts[each.items[4]], *each.items[6:9])
            if is_number
            else (each.items[2], each.items[3], *each.items[6:8])
        )
        assert method in units
        assert float(low) < float(high)
        symbol, offset = each.after("SYMBOL_LINK", 2)
        assert name not in result
        result[name] = (symbol.strip('"'), int(offset), kind)
    return result


def test_every_offset_and_type_is_that_of_the_compiler(joint):
    layout, path, folder = joint
    found = entries(module(path))
    members = {f"joint.block.{w}": ("block", w) for w in ("magic", "version", "size", "checksum")}
    members |= {f"joint.block.digest[{i}]": ("block", f"digest[{i}]") for i in range(4)}
    members |= {f"joint.block.deck[{i}]": ("block", f"deck[{i}]") for i in range(2)}
    members |= {
        f"joint.{name}": ("block", f"parameters.{p}")
        for name, p in paths_in_memory(layout.parameters).items()
    }
    members |= {
        f"joint.coefficient[{i}]": ("block", f"coefficients[{i}]") for i in range(len(layout.coefficients))
    }
    members |= {
        f"joint.table_{k}.{v.name}": ("block", f"table_{k}[{j}][0]")
        for k, table in enumerate(layout.tables)
        for j, v in enumerate(table.columns)
    }
    for group in ("inputs", "states", "outputs"):
        paths = paths_in_memory(getattr(layout, group))
        members |= {f"joint.{group}.{name}": ("state", f"{group}.{path}") for name, path in paths.items()}
    members |= {f"joint.{name}": ("state", name) for name in ("status", "loaded")}
    assert members.keys() == found.keys()
    lines = [
        f'    printf("%s %zu %zu\\n", "{name}", offsetof(joint_{kind}, {member}), '
        f"sizeof(((joint_{kind} *)0)->{member}));"
        for name, (kind, member) in members.items()
    ]
    main = folder / "offsets.c"
    head = '#include <stdio.h>\n#include <stddef.h>\n#include "joint.h"\nint main(void)\n{\n'
    main.write_text(head + "\n".join(lines) + "\n    return 0;\n}\n")
    program = compile_program([main], folder / "offsets", flags=[])
    sizes = {"FLOAT32_IEEE": 4, "FLOAT64_IEEE": 8, "ULONG": 4}
    written = subprocess.run([program], capture_output=True, check=True, text=True).stdout
    for line in written.splitlines():
        name, offset, size = line.split()
        symbol, at, kind = found[name]
        assert (symbol, at, sizes[kind]) == (members[name][0], int(offset), int(size)), name


def test_units_ranges_and_axes_are_those_of_the_model(joint):
    layout, path, _ = joint
    found = module(path)
    assert "MSB_LAST" in found.of("MOD_COMMON")[0].after("BYTE_ORDER", 1)
    by_name = {each.items[0]: each for each in found.of("CHARACTERISTIC")}
    shown = {each.items[0]: each.items[-1].strip('"') for each in found.of("COMPU_METHOD")}
    for v in layout.parameters:
        each = by_name[f"joint.{v.name}"]
        assert shown[each.items[6]] == ("" if v.unit == "1" else v.unit)
        assert float(each.items[7]) == max(v.minimum, -layout.real.largest)
        assert float(each.items[8]) == min(v.maximum, layout.real.largest)
    (table, *_) = layout.tables
    curve = by_name[f"joint.table_0.{table.columns[0].name}"]
    (axis,) = curve.of("AXIS_DESCR")
    assert axis.items[:3] == ["FIX_AXIS", "joint.inputs.motor.angle", "unit_rad"]
    assert [float(x) for x in axis.of("FIX_AXIS_PAR_LIST")[0].items] == table.grid.tolist()


@pytest.mark.skipif(READER is None, reason="a2ltool is not installed: pip install 'nlsdesign[a2l]'")
def test_an_independent_reader_finds_nothing_wrong(joint, tmp_path):
    _, path, _ = joint
    run = subprocess.run([READER, "--strict", "--check", path], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "No problems found" in run.stdout + run.stderr
    damaged = tmp_path / "damaged.a2l"
    damaged.write_text(path.read_text().replace("joint.inputs.motor.angle unit_rad", "nothing unit_none", 1))
    again = subprocess.run(
        [READER, "--strict", "--check", damaged], capture_output=True, text=True, check=False
    )
    assert "No problems found" not in again.stdout + again.stderr


def test_the_record_of_a_monitor_lies_where_its_description_says(tmp_path):
    """Offsets by the compiler of this machine, sizes of arrays, and an independent reader."""
    plant = nls.flatten(smoothed(nls.declare(nls.load_deck("austin2015_figure_consistent"))))
    source = export_watch(watch_plan(plant, 1e-3), tmp_path)
    path = write_watch_a2l(source, tmp_path / "watch.a2l")
    (block,) = source.plan.blocks
    members = {f"watch.{w}": w for w in ("magic", "version", "size", "judged", "word", "checksum")}
    members |= {
        f"watch.reference.{block.name}.{change}": f"reference[0][{k}]"
        for k, change in enumerate(block.changes)
    }
    for group, place in [("recent.motor", "recent[0]")] + [
        (f"bins.motor[{k}]", f"bins[0][{k}]") for k in range(12)
    ]:
        members |= {f"watch.{group}.{w}": f"{place}.{w}" for w in ("count", "products")}
    lines = [
        f'    printf("{name} %zu %zu\\n", offsetof(watch_state, record.{member}), '
        f"sizeof(((watch_state *)0)->record.{member}));"
        for name, member in members.items()
    ]
    main = tmp_path / "offsets.c"
    head = '#include <stdio.h>\n#include <stddef.h>\n#include "watch.h"\nint main(void)\n{\n'
    main.write_text(head + "\n".join(lines) + "\n    return 0;\n}\n")
    written = subprocess.run([compile_program([main], tmp_path / "offsets", flags=[])],
                             capture_output=True, check=True, text=True).stdout  # fmt: skip
    found = {each.items[0]: each for each in module(path).of("MEASUREMENT")}
    assert found.keys() == members.keys()
    for line in written.splitlines():
        name, at, size = line.split()
        each = found[name]
        count = int(each.after("MATRIX_DIM", 1)[0]) if "MATRIX_DIM" in each.items else 1
        assert (each.after("SYMBOL_LINK", 2), 4 * count) == (['"monitor"', at], int(size)), name
    if READER is not None:
        run = subprocess.run(
            [READER, "--strict", "--check", path], capture_output=True, text=True, check=False
        )
        assert "No problems found" in run.stdout + run.stderr


@pytest.mark.parametrize("target", ["x86_64-freestanding", "thumb-freestanding-eabihf"])
def test_addresses_come_from_the_program(joint, target, tmp_path):
    layout, _, folder = joint
    main, elf = tmp_path / "main.c", tmp_path / "main.elf"
    main.write_text(
        '#include "joint.h"\njoint_block block;\njoint_state state;\n'
        "void _start(void)\n{\n    block.magic = 1u;\n    state.status = 1u;\n}\n"
    )
    run_compiler(
        ["-target", target, "-O1", "-fno-sanitize=all", "-nostdlib", "-I", folder, main, "-o", elf],
        about=target,
    )
    places = elf_symbols(elf, ("block", "state"))
    assert min(places.values()) > 0
    found = module(write_a2l(layout, tmp_path / "placed.a2l", elf=elf))
    for each in found.of("MEASUREMENT"):
        offset = int(each.after("SYMBOL_LINK", 2)[1])
        assert int(each.after("ECU_ADDRESS", 1)[0], 16) == places["state"] + offset
    for each in found.of("CHARACTERISTIC"):
        assert int(each.items[3], 16) == places["block"] + int(each.after("SYMBOL_LINK", 2)[1])
    if shutil.which("nm"):
        listed = subprocess.run(["nm", elf], capture_output=True, text=True, check=True).stdout
        rows = [line.split() for line in listed.splitlines()]
        known = {row[2]: int(row[0], 16) for row in rows if len(row) == 3}
        assert places == {name: known[name] for name in ("block", "state")}
    with pytest.raises(ExportError, match=r"symbol .blok.: does not exist"):
        elf_symbols(elf, ("blok",))


def test_programs_without_the_symbols_are_refused(joint, tmp_path):
    layout, path, _ = joint
    with pytest.raises(ExportError, match="is no ELF file"):
        write_a2l(layout, tmp_path / "x.a2l", elf=path)
    (tmp_path / "short.elf").write_bytes(b"\x7fELF\x01\x01")
    with pytest.raises(ExportError, match="is no ELF file"):
        write_a2l(layout, tmp_path / "x.a2l", elf=tmp_path / "short.elf")
    with pytest.raises(ExportError, match="cannot be read"):
        write_a2l(layout, tmp_path / "x.a2l", elf=tmp_path / "none.elf")
    with pytest.raises(ExportError, match="is no name of a variable"):
        write_a2l(layout, tmp_path / "x.a2l", block="my block")
    assert not (tmp_path / "x.a2l").exists()
