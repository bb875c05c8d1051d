"""The programs beside a generated step compile and run; the supervisor does what its header says."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess

import pytest

from nlsdesign.export import CSource, export_c, write_examples
from nlsdesign.export.c.guarded_step import (
    COMMAND_SLOWED,
    INPUT_HELD,
    INPUT_JUMPED,
    INPUT_STALE,
    NOT_STARTED,
    STATE_RESTARTED,
    WAITING,
    index_bit,
)
from nlsdesign.export.compilation.cross_compiler import STRICT, compile_library, run_compiler
from nlsdesign.foundation.errors import ExportError
from tests.compiling import compile_program
from tests.hand_built import observer

ADAPTER = """
#include "loop_supervisor.h"
#pragma GCC visibility push(default)
static loop_supervisor supervisor;
void reset(void) { supervisor = (loop_supervisor){0}; }
double share(uint32_t status) { return (double)loop_supervise(&supervisor, status); }
"""
CLASS = """
#include "loop.hpp"
int main()
{
    loop one;
    loop::inputs_type inputs{};
    (void)one.step(inputs, 1000u);
    (void)one.step(inputs, 1000u);
    return one.status() == LOOP_SAMPLE_REPEATED ? 0 : 1;
}
"""


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> CSource:
    made = export_c(observer(), tmp_path_factory.mktemp("c"), name="loop")
    assert all(file.is_file() for file in write_examples(made))
    return made


@pytest.fixture
def supervisor(source: CSource, tmp_path):
    adapter = tmp_path / "adapter.c"
    adapter.write_text(ADAPTER)
    library = compile_library(
        [adapter], tmp_path / "supervisor.so", include=[source.header.parent], flags=["-std=c99"]
    )
    loaded = ctypes.CDLL(str(library))
    loaded.share.restype = ctypes.c_double
    return loaded


def test_the_program_on_a_posix_timer_runs(source: CSource, tmp_path) -> None:
    folder = source.header.parent
    program = compile_program(
        [source.source, folder / "loop_example_posix.c"], tmp_path / "program", flags=[*STRICT, f"-I{folder}"]
    )
    done = subprocess.run([program, "3"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    run_compiler(
        [*STRICT, "-I", folder, "-c", folder / "loop_example_cortex_m.c", "-o", tmp_path / "timer.o"],
        about="the example",
    )


def test_a_board_without_a_unit_for_its_numbers_is_told_so(tmp_path) -> None:
    """A Cortex-M3 has none, that of a Cortex-M4F knows no double; who has the time may go on."""
    for real, features, said in (
        ("float", "cortex_m4+vfp4d16sp", ""),
        ("double", "cortex_m7+fp_armv8d16", ""),
        ("double", "cortex_m4+vfp4d16sp", "unit for double"),
        ("float", "cortex_m3", "unit for float"),
    ):
        folder = tmp_path / f"{real}_{features}"
        write_examples(export_c(observer(), folder, name="loop", real=real))
        ending = "eabi" if features == "cortex_m3" else "eabihf"
        target = ["-target", f"thumb-freestanding-{ending}", f"-mcpu={features}"]
        command = [*target, "-I", folder, "-o", folder / "timer.o", "-c"]
        program = folder / "loop_example_cortex_m.c"
        if said:
            with pytest.raises(ExportError, match=f"{said}: a step takes forty times longer"):
                run_compiler([*command, program], about="the example")
            command.append("-DSOFT_NUMBERS")
        run_compiler([*command, program], about="the example")


SHOWN = """
#include "loop.h"
loop_state state;
int main(void)
{
    loop_inputs inputs = {.motor.angle = 0.25, .motor.current = 2.0};
    loop_outputs outputs;
    (void)loop_init(&state, 0);
    (void)loop_step(&state, &inputs, &outputs);
    (void)loop_set_parameters(&state, &state.parameters);
    return READ;
}
"""


def test_a_debugger_shows_each_number_by_its_flat_name(source: CSource, tmp_path) -> None:
    """Paths in the structures are up to five members deep."""
    script = source.header.with_name("loop.gdb")
    lines = re.findall(
        r'printf "(\w+) (\S+) = %.9g [^"]*", \$arg0\.(\w+)\.([\w.]+)$', script.read_text(), re.MULTILINE
    )
    groups = ("inputs", "outputs", "states", "parameters")
    assert [line[:2] for line in lines] == [(g, v.name) for g in groups for v in getattr(source.model, g)]
    read = " + ".join(f"(state.{group}.{path} > 1e30)" for _, _, group, path in lines)
    (tmp_path / "main.c").write_text(SHOWN.replace("READ", read))
    files = [tmp_path / "main.c", source.source]
    program = compile_program(files, tmp_path / "main", flags=["-std=c99", f"-I{source.header.parent}"])
    assert subprocess.run([program], timeout=60).returncode == 0


# Quick: the test above.
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gdb") is None or shutil.which("gcc") is None, reason="no gdb, or no gcc")
def test_gdb_prints_an_instance(source: CSource, tmp_path) -> None:
    (tmp_path / "main.c").write_text(SHOWN.replace("READ", "0"))
    build = ["gcc", "-std=c99", "-g", "-ffp-contract=off", f"-I{source.header.parent}"]
    program = tmp_path / "main"
    subprocess.run([*build, tmp_path / "main.c", source.source, "-lm", "-o", program], check=True, timeout=60)
    orders = [*("-ex", "break loop_set_parameters"), "-ex", "run", "-ex", "loop_show state"]
    command = ["gdb", "-q", "-nx", "-batch", "-x", source.header.with_name("loop.gdb"), *orders, program]
    said = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert "inputs motor.angle = 0.25 rad\ninputs motor.current = 2 A\n" in said.stdout, said.stderr


@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++")
def test_the_class_knows_late_and_repeated_samples(source: CSource, tmp_path) -> None:
    (tmp_path / "main.cpp").write_text(CLASS)
    run_compiler(
        ["-std=c99", "-fno-sanitize=undefined", "-c", source.source, "-o", tmp_path / "step.o"],
        about="the step",
    )
    build = ["g++", "-std=c++11", "-Wall", "-Wextra", "-Werror", f"-I{source.header.parent}"]
    files = [tmp_path / "main.cpp", tmp_path / "step.o", "-lm", "-o", tmp_path / "main"]
    subprocess.run([*build, *files], check=True, timeout=120)
    assert subprocess.run([tmp_path / "main"], timeout=60).returncode == 0


@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++")
@pytest.mark.parametrize("name", ["step", "status", "outputs_"])
def test_a_class_has_another_name_than_its_members(tmp_path, name: str) -> None:
    made = export_c(observer(), tmp_path, name=name)
    write_examples(made)
    (tmp_path / "main.cpp").write_text(
        f'#include "{name}.hpp"\nint main() {{ return {name}_object{{}}.status() == 0; }}\n'
    )
    build = ["g++", "-std=c++11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", f"-I{tmp_path}"]
    subprocess.run([*build, tmp_path / "main.cpp"], check=True, timeout=120)


def test_ten_faulty_samples_more_than_good_ones_cut_and_six_derate(supervisor) -> None:
    lost = INPUT_HELD | index_bit(0)
    assert [supervisor.share(lost) for _ in range(5)] == [1.0] * 5
    assert [supervisor.share(0) for _ in range(5)] == [1.0] * 5
    shares = [supervisor.share(INPUT_JUMPED | index_bit(0)) for _ in range(10)]
    assert shares == pytest.approx([1.0] * 5 + [0.8, 0.6, 0.4, 0.2, 0.0])
    # A cut stays until it is reset.
    assert [supervisor.share(0) for _ in range(100)] == [0.0] * 100
    supervisor.reset()
    assert supervisor.share(0) == 1.0


def test_good_samples_take_back_what_was_derated(supervisor) -> None:
    assert [supervisor.share(INPUT_HELD) for _ in range(8)][-1] == pytest.approx(0.4)
    assert [supervisor.share(0) for _ in range(3)] == pytest.approx([0.6, 0.8, 1.0])


@pytest.mark.parametrize("grave", [STATE_RESTARTED, INPUT_STALE | index_bit(0)])
def test_a_dead_encoder_and_a_damaged_state_cut_at_once(supervisor, grave: int) -> None:
    assert supervisor.share(grave) == 0.0
    assert supervisor.share(0) == 0.0


def test_nothing_acts_before_the_first_reading_and_commands_that_ask_too_much_are_no_fault(
    supervisor,
) -> None:
    assert [supervisor.share(word) for word in (NOT_STARTED, WAITING, 0)] == [0.0, 0.0, 1.0]
    assert [supervisor.share(COMMAND_SLOWED) for _ in range(50)] == [1.0] * 50
