"""Blocks of numbers: what generated code takes over at run time, and what it refuses."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nlsdesign.export import export_c, loadable_model, read_parameter_block, write_parameter_block
from nlsdesign.foundation.errors import ExportError
from nlsdesign.model import FlatModel, Variable, flatten
from nlsdesign.regeneration import block_for
from tests.blocks import BETTER, Running, controller, exported, machine, motion, recipe

FITS, NOT_STARTED, NO_BLOCK, OTHER_VERSION, FOREIGN, DAMAGED, OUT_OF_RANGE = range(7)


@pytest.fixture(scope="module")
def joint(tmp_path_factory):
    """Return the code of the published machine in float, its block and that of a better deck."""
    folder = tmp_path_factory.mktemp("joint")
    source, code = exported(folder, "float")
    return source, code, block_for(code, machine().with_values(BETTER), controller), folder


def resealed(content: bytes, place: int, form: str, value: float) -> bytes:
    """Return a block with another number and the checksum that belongs to it."""
    changed = bytearray(content)
    struct.pack_into(form, changed, place, value)
    struct.pack_into("<I", changed, len(changed) - 8, zlib.crc32(changed[:-8]))
    return bytes(changed)


def started(joint) -> Running:
    running = Running(joint[0], joint[3])
    assert running.call("init", None) == 0
    return running


@pytest.mark.slow
def test_a_loaded_block_makes_the_code_of_the_better_deck(joint, tmp_path):
    _, _, better, _ = joint
    plain = recipe().designed(flatten(machine().with_values(BETTER)), controller)
    expected = Running(export_c(plain, tmp_path, real="float", name="better"), tmp_path)
    assert expected.call("init", None) == 0
    running = started(joint)
    assert running.load(better.packed()) == FITS
    assert np.array_equal(running.steps(motion(400)), expected.steps(motion(400)))
    before = started(joint).steps(motion(400))
    assert np.max(np.abs(before[:, 0] - running.steps(motion(400))[:, 0])) > 0.05


def test_the_block_of_the_design_changes_nothing(joint, tmp_path):
    _, code, _, _ = joint
    plain = recipe().designed(flatten(machine()), controller)
    expected = Running(export_c(plain, tmp_path, real="float", name="plain"), tmp_path)
    assert expected.call("init", None) == 0
    running = started(joint)
    wanted = expected.steps(motion(300))
    rows = running.steps(motion(100))
    assert running.load(code.packed()) == FITS
    assert np.array_equal(np.vstack([rows, running.steps(motion(200, 100))]), wanted)


@pytest.mark.slow
def test_both_halves_of_a_joined_step_get_the_numbers(joint):
    """A weaker motor gets more current, and the observer expects the same motion of it.

    Where the controller alone knows that the motor is weaker, the observer expects another motion.
    """
    source, code, _, _ = joint
    layout = code.layout
    weaker = block_for(code, machine().with_values({"motor.torque_constant": 0.0495}), controller)
    whole, half, design = started(joint), started(joint), started(joint)
    assert whole.load(weaker.packed()) == FITS
    given = np.array([weaker.values[v.name] for v in layout.parameters], np.float32)
    assert half.call("set_parameters", given) == 0
    names = [v.name for v in source.model.outputs]
    current, speed = names.index("motor.current"), names.index("motor.speed")
    rows = {name: each.steps(motion(60))[-1] for name, each in
            (("whole", whole), ("half", half), ("design", design))}  # fmt: skip
    assert rows["whole"][current] == pytest.approx(rows["design"][current] / 0.9, rel=1e-3)
    assert rows["whole"][speed] == pytest.approx(rows["design"][speed], abs=1e-4)
    assert abs(rows["half"][speed] - rows["design"][speed]) > 0.1


@pytest.mark.parametrize(
    ("place", "form", "value", "seal", "code"),
    [
        (0, "<I", 1, True, NO_BLOCK),
        (4, "<I", 2, True, OTHER_VERSION),
        (8, "<I", 4, True, OTHER_VERSION),
        (16, "<I", 1, True, FOREIGN),
        (28, "<I", 1, True, FOREIGN),
        (40, "<f", 2.5, False, DAMAGED),
        (40, "<f", float("nan"), True, OUT_OF_RANGE),
        (40, "<f", float("inf"), True, OUT_OF_RANGE),
        (40, "<f", -1.0, True, OUT_OF_RANGE),
    ],
)
def test_what_is_wrong_has_a_name_and_the_old_numbers_stay(joint, place, form, value, seal, code):
    _, _, better, _ = joint
    content = bytearray(better.packed())
    struct.pack_into(form, content, place, value)
    running, expected = started(joint), started(joint).steps(motion(120))
    rows = running.steps(motion(60))
    assert running.load(resealed(bytes(content), place, form, value) if seal else bytes(content)) == code
    assert np.array_equal(np.vstack([rows, running.steps(motion(60, 60))]), expected)


def test_any_flipped_bit_is_refused(joint):
    _, _, better, _ = joint
    content, running = better.packed(), started(joint)
    draw = np.random.default_rng(3)
    for place in [*range(40), *draw.integers(40, len(content) - 4, 60)]:
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(draw.integers(8))
        assert running.load(bytes(damaged)) != FITS, place
    assert running.load(content) == FITS


def test_a_number_out_of_range_at_the_end_of_a_table_is_seen(joint):
    _, _, better, _ = joint
    layout = better.layout
    place = layout.offset("checksum") - 4
    assert started(joint).load(resealed(better.packed(), place, "<f", 1e4)) == OUT_OF_RANGE


def test_before_init_nothing_is_taken(joint):
    running = Running(joint[0], joint[3])
    assert running.load(joint[1].packed()) == NOT_STARTED


def test_files_come_back_as_they_were(joint, tmp_path):
    _, code, better, _ = joint
    layout = code.layout
    for block in (code, better):
        for ending in (".bin", ".json"):
            file = write_parameter_block(block, tmp_path / f"block{ending}")
            again = read_parameter_block(file, layout)
            assert again.packed() == block.packed()
    assert read_parameter_block(tmp_path / "block.json").layout.record == layout.record
    assert (tmp_path / "block.bin").read_bytes() == better.packed()


def test_the_block_in_c_is_the_bytes_of_the_file(joint, tmp_path):
    from tests.compiling import compile_program

    source, _, better, folder = joint
    constant = write_parameter_block(better, tmp_path / "better.c")
    main = tmp_path / "main.c"
    main.write_text(
        '#include <stdio.h>\n#include "joint.h"\n'
        "extern const joint_block joint_block_of_austin2015_figure_consistent;\n"
        "int main(void) { const joint_block *block = &joint_block_of_austin2015_figure_consistent;\n"
        "    return (joint_check(block) == JOINT_BLOCK_FITS && joint_checksum(block) == block->checksum\n"
        "        && fwrite(block, sizeof *block, 1u, stdout) == 1u) ? 0 : 1; }\n"
    )
    from nlsdesign.export.compilation.cross_compiler import STRICT

    program = compile_program(
        [main, constant, source.source], tmp_path / "dump", flags=[*STRICT, "-I", str(folder)]
    )
    import subprocess

    written = subprocess.run([program], capture_output=True, check=True).stdout
    assert written == better.packed()


def test_reading_refuses_damaged_and_foreign_files(joint, tmp_path):
    _, _, better, _ = joint
    layout = better.layout
    content = better.packed()
    file = tmp_path / "block.bin"
    foreign = replace(layout, digest="0" * 32, deck="other")
    for changed, wanted, says in (
        (content[:-1], layout, "bytes"),
        (b"x" + content[1:], layout, "no block"),
        (content[:100] + bytes([content[100] ^ 1]) + content[101:], layout, "checksum"),
        (content, foreign, "digest .* is of other code; 'joint' of deck 'other'"),
        (resealed(content, 40, "<f", -1.0), layout, "'controller.stiffness_floor' is -1"),
        (content, None, "code must be named"),
    ):
        file.write_bytes(changed)
        with pytest.raises(ExportError, match=says):
            read_parameter_block(file, wanted)
    text = write_parameter_block(better, tmp_path / "block.json").read_text()
    for before, after, says in (
        ('"value": 12.0', '"value": 11.0', "damaged or edited"),
        ('"format": "nlsdesign parameter block 1"', '"format": "x"', "not of the format"),
        ('"real": "float",\n', "", "lacks a field"),
        ("{", "", "no JSON"),
    ):
        assert before in text
        (tmp_path / "edited.json").write_text(text.replace(before, after, 1))
        with pytest.raises(ExportError, match=f"{says}.* -> "):
            read_parameter_block(tmp_path / "edited.json")
    with pytest.raises(ExportError, match="cannot be read"):
        read_parameter_block(tmp_path / "none.json")


def test_numbers_that_the_code_cannot_take_are_named(joint, tmp_path):
    _, code, _, _ = joint
    with pytest.raises(ExportError, match=r"'motor\.current_limit' is 40 A.*1e-06 to 20"):
        block_for(code, machine().with_values({"motor.current_limit": 40.0}), controller)
    with pytest.raises(ExportError, match=r"controller\.bandwith.*is no parameter"):
        code.with_values({"controller.bandwith": 3.0})
    assert code.with_values({"controller.bandwidth": 9.0}).values["controller.bandwidth"] == 9.0
    with pytest.raises(ExportError, match=r"endings \.json"):
        write_parameter_block(code, tmp_path / "block.hex")


@pytest.mark.slow
def test_a_deck_of_another_form_is_refused(joint):
    _, code, _, _ = joint
    with pytest.raises(ExportError, match="export the code again"):
        block_for(code, machine().with_values({"spring.cam.last_angle": 1.0}), controller)
    with pytest.raises(ExportError, match="export the code again"):
        block_for(code, machine("test_rig"), controller)


def sampled(a: float, b: float, name: str = "k") -> FlatModel:
    """Return x⁺ = a·x and y = b·u·p by hand."""
    t, x, u, p, w = (ca.SX.sym(n, k) for n, k in zip("txupw", (1, 1, 1, 1, 0), strict=True))
    equations = ca.Function(
        "equations", [t, x, u, p, w], [a * x, b * u * p, ca.SX(0, 1), ca.SX(0, 1)],
        ["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"],
    )  # fmt: skip
    one = Variable("x", "rad", "a state")
    parameter = Variable(name, "1", "a parameter", start=1.5, minimum=0.0)
    return FlatModel("hand", "by hand", (one,), (Variable("u", "A", "an input"),), (parameter,),
                     (Variable("y", "rad", "an output"),), (), equations, 1e-3)  # fmt: skip


def test_what_moves_with_the_numbers_is_a_coefficient_and_what_stays_is_not():
    made = loadable_model(sampled(1.0, 3.0), sampled(1.01, 3.0))
    assert [v.start for v in made.model.parameters] == [1.5, 1.0]
    for value in (0.4, 1.0, -1.0, 2.0):
        assert made.numbers_of(sampled(value, 3.0)).coefficients == (value,)
    for other, says in (
        (sampled(0.4, 3.1), r"constant 3\.1 in place of 3"),
        (sampled(0.0, 3.0), "other operations|other results"),
        (sampled(0.4, 3.0, name="q"), "other parameters: k .* is lacking, q .* is added"),
    ):
        with pytest.raises(ExportError, match=says):
            made.numbers_of(other)
