"""The example firmware on an emulated processor, against FMUs of its machine and of its own step."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.firmware_in_the_loop import BOARD, Firmware, image, made, run_both, run_faults
from nlsdesign.export import CORTEX_M4F, CORTEX_M7
from nlsdesign.export.compilation.target_run import missing_emulator

# Emulator and compiler are programs of the system, no packages: where they are absent nothing is proved here.
pytestmark = pytest.mark.skipif(bool(missing_emulator()), reason=missing_emulator())


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Firmware:
    return made(CORTEX_M7, "double", tmp_path_factory.mktemp("firmware"))


@pytest.mark.parametrize("samples", [1000, pytest.param(5000, marks=pytest.mark.slow)])
def test_firmware_and_fmu_give_the_same_bits(firmware, tmp_path, samples):
    run = run_both(firmware, CORTEX_M7, samples, tmp_path)
    assert run.differing == 0
    assert run.faults == 0
    # The loop was alive: torques of newton metres, followed to a tenth.
    assert run.largest_torque > 2.0
    assert run.tracking < 0.2
    # A step ends well within its millisecond, 31,250 instructions.
    assert 100 < run.instructions[0] <= run.instructions[1] < 5000


@pytest.mark.parametrize(
    ("samples", "seed", "faults"), [(600, 3, 2), pytest.param(2500, 3, 4, marks=pytest.mark.slow)]
)
def test_nothing_locks_when_interrupts_frames_and_supply_fail(firmware, tmp_path, samples, seed, faults):
    run = run_faults(firmware, CORTEX_M7, samples, tmp_path, seed=seed)
    assert sum(run.given.values()) >= faults
    assert run.given["brown out"] > 0
    assert (run.processor_faults, run.restarts, run.lost, run.beyond, run.unflagged) == (0, 0, 0, 0, 0)
    assert run.worst < 0.04


@pytest.fixture
def other(tmp_path, firmware):
    """Return the firmware with another board."""

    def compiled(text: str) -> Firmware:
        board = tmp_path / "other_board.h"
        board.write_text(text)
        return replace(firmware, image=image(firmware.source, CORTEX_M7, firmware.quantum, board))

    return compiled


def test_a_count_that_is_read_wrongly_is_noticed(other, tmp_path):
    text = (BOARD / "board.h").read_text()
    assert text.count("#define QUANTUM ENCODER_QUANTUM") == 1
    wrong = other(text.replace("ENCODER_QUANTUM ", "(ENCODER_QUANTUM * (1.0 + 2.3e-16))", 1))
    run = run_both(wrong, CORTEX_M7, 200, tmp_path)
    assert run.differing > 50
    assert 0 <= run.first < 100


@pytest.mark.slow
def test_a_fault_of_the_processor_and_a_restart_are_counted(other, tmp_path):
    text = (BOARD / "board.h").read_text()
    assert text.count("    static uint32_t last_frame;") == 1
    nowhere = "*(volatile uint32_t *)0xE0200000u = 1u;"
    trap = f"if (BOARD_CELLS->samples == 150u) {{ BOARD_CELLS->samples = 151u; {nowhere} }}\n"
    run = run_faults(
        other(text.replace("    given->motor.angle =", trap + "    given->motor.angle =", 1)),
        CORTEX_M7, 300, tmp_path, seed=1,
    )  # fmt: skip
    assert run.processor_faults == 1
    assert run.restarts == 1


@pytest.mark.slow
@pytest.mark.parametrize("corrected", [False, True], ids=["cascade", "corrected"])
def test_firmware_in_float_gives_the_bits_of_this_machine(corrected, tmp_path):
    run = run_both(made(CORTEX_M4F, "float", tmp_path, corrected=corrected), CORTEX_M4F, 5000, tmp_path)
    assert run.differing == 0
    assert run.tracking < 0.2
