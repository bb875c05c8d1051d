"""Generated code on Cortex-M: sizes, instructions, stack, and the bits that this machine computes."""

from __future__ import annotations

import re

import numpy as np
import pytest

from nlsdesign.export import export_c
from nlsdesign.export.compilation import target_run
from nlsdesign.export.compilation.cross_compiler import run_compiler
from nlsdesign.export.compilation.processors import CORTEX_M4F, PROCESSORS
from nlsdesign.export.compilation.target_run import (
    SectionSizes,
    emulated,
    measure_on_target,
    missing_emulator,
    section_sizes,
)
from nlsdesign.foundation.errors import ExportError
from tests.hand_built import controller, observer

needs_emulator = pytest.mark.skipif(bool(missing_emulator()), reason=missing_emulator())


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    return export_c(observer(), tmp_path_factory.mktemp("c"), real="float")


@pytest.fixture(scope="module")
def usual(source):
    """What the observer costs as it is."""
    return measure_on_target(source, CORTEX_M4F)


def changed(source, folder, before: str, after: str):
    """The same controller with one place of its code changed."""
    again = export_c(source.model, folder, real=source.real)
    text, count = re.subn(before, after, again.source.read_text(), count=1)
    assert count == 1
    again.source.write_text(text)
    return again


def test_sizes_are_read_from_an_object(tmp_path):
    (tmp_path / "sizes.c").write_text(
        "extern const unsigned char table[1000]; const unsigned char table[1000] = {1};\n"
        "extern int preset[5]; int preset[5] = {1};\n"
        "extern char cleared[300]; char cleared[300];\n"
    )
    run_compiler(
        ["-target", CORTEX_M4F.target, "-c", tmp_path / "sizes.c", "-o", tmp_path / "sizes.o"], about="sizes"
    )
    assert section_sizes(tmp_path / "sizes.o") == SectionSizes(constant=1000, preset=20, cleared=300)
    (tmp_path / "other.o").write_bytes(b"\x7fELF\x02\x01" + bytes(100))
    with pytest.raises(ExportError, match=r"other\.o.*32-bit ELF"):
        section_sizes(tmp_path / "other.o")


def test_without_the_emulator_sizes_are_measured_and_the_reason_is_given(source, monkeypatch):
    monkeypatch.setattr(target_run.shutil, "which", lambda name: None)
    cost = measure_on_target(source)
    assert cost.run is None
    assert "qemu-system-arm is not installed" in cost.reason
    table = source.model.tables[0].values.size * 4
    assert table < cost.alone.constant < table + 6000
    assert cost.alone.preset == cost.alone.cleared == 0
    # Measured numbers of the structure: floats, and counters of 32 bits.
    assert cost.state % 4 == 0
    assert cost.memory == cost.state >= 4 * len(source.model.states + source.model.parameters)
    with pytest.raises(ExportError, match="not installed") as caught:
        emulated(source.source, CORTEX_M4F)
    assert "\n" not in str(caught.value)


@needs_emulator
def test_the_processor_computes_the_bits_of_this_machine(source, usual):
    assert usual.run.same
    assert usual.run.outputs.shape == (120, len(source.model.outputs))
    assert len(np.unique(usual.run.outputs[:, 0])) > 100
    assert len(set(usual.run.status)) > 3


@needs_emulator
@pytest.mark.slow
@pytest.mark.parametrize("processor", PROCESSORS, ids=lambda each: each.name)
@pytest.mark.parametrize("real", ["float", "double"])
@pytest.mark.parametrize("model", [observer(), controller()], ids=["observer", "controller"])
def test_every_processor_computes_the_bits_of_this_machine(model, real, processor, tmp_path):
    assert measure_on_target(export_c(model, tmp_path, real=real), processor).run.same


@pytest.mark.slow
@needs_emulator
def test_the_comparison_notices_one_unit_of_the_last_place(source, tmp_path):
    there = r"\n#ifdef __arm__\n\1(\2) * (1.0f + FLT_EPSILON);\n#else\n\1\2;\n#endif"
    other = changed(source, tmp_path, r"(    const float y0 = )(.*);", there)
    assert not measure_on_target(other).run.same


@needs_emulator
def test_instructions_and_stack_are_counted(source, usual, tmp_path):
    # 1000 turns of two instructions and one before, 512 bytes that are touched from end to end.
    loop = '__asm__ volatile("movw r3, #1000\\\\n1:\\\\tsubs r3, #1\\\\n\\\\tbne 1b" ::: "r3", "cc");'
    step = r"(_advance\(.*\n\{\n    uint32_t status = 0u;\n)"
    slower = measure_on_target(
        changed(source, tmp_path / "a", step, rf"\1#ifdef __arm__\n    {loop}\n#endif\n")
    )
    more = slower.run.instructions - usual.run.instructions
    # Of all steps but those that wait for a reading; the compiler may place one register elsewhere.
    assert np.abs(more - 2001).max() <= 4
    buffer = "volatile char kept[512]; for (int k = 0; k < 512; ++k) { kept[k] = 1; } (void)kept[7];"
    deeper = measure_on_target(changed(source, tmp_path / "b", step, rf"\1    {buffer}\n"))
    assert 512 <= deeper.run.stack.max() - usual.run.stack.max() <= 528
    assert 8 <= usual.run.stack.max() < 512


@needs_emulator
def test_a_wrong_count_is_noticed_on_the_loop_of_known_length(source, monkeypatch):
    monkeypatch.setattr(target_run, "_NS_PER_TICK", 41)
    with pytest.raises(ExportError, match=r"count on Cortex-M4F.*is wrong: 20.* for a loop of 2003"):
        measure_on_target(source)


@needs_emulator
def test_a_fault_on_the_processor_is_an_error(source, tmp_path):
    step = r"(_advance\(.*\n\{\n    uint32_t status = 0u;\n)"
    broken = changed(source, tmp_path, step, r"\1    *(volatile int *)0xF0000000u = 1;\n")
    with pytest.raises(ExportError, match=r"fails under qemu-system-arm: .*fault"):
        measure_on_target(broken)
