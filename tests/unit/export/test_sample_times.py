"""A step that is told when its inputs were read flags late and repeated samples."""

from __future__ import annotations

import ctypes
from dataclasses import replace

import pytest

from nlsdesign.export import export_c
from nlsdesign.export.c.guarded_step import NOT_STARTED, RECOVERED, SAMPLE_LATE, SAMPLE_REPEATED, index_bit
from nlsdesign.export.compilation.cross_compiler import compile_library
from nlsdesign.model import Plausibility
from tests.hand_built import observer

PERIOD = 1000
"""Microseconds from sample to sample of the observer."""
ADAPTER = """
#include "step.h"
#pragma GCC visibility push(default)
static step_state state;
static step_clock clock;
void begin(void) { (void)step_init(&state, 0); clock = (step_clock){0}; }
void wipe(void) { state = (step_state){0}; }
uint32_t sample(double angle, uint32_t at, double *estimate)
{
    step_inputs inputs = {0};
    step_outputs outputs;
    inputs.motor.angle = angle;
    const uint32_t status = step_step_at(&clock, &state, &inputs, &outputs, at);
    *estimate = outputs.spring.torque;
    return status;
}
uint32_t plain(double angle, double *estimate)
{
    step_inputs inputs = {0};
    step_outputs outputs;
    inputs.motor.angle = angle;
    const uint32_t status = step_step(&state, &inputs, &outputs);
    *estimate = outputs.spring.torque;
    return status;
}
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("c")
    model = observer()
    angle = replace(model.inputs[0], plausibility=Plausibility(largest_rate=20.0, stale_time=100.0))
    source = export_c(replace(model, inputs=(angle, *model.inputs[1:])), folder, name="step")
    adapter = folder / "adapter.c"
    adapter.write_text(ADAPTER)
    made = compile_library([adapter, source.source], folder / "step.so", include=[folder], flags=["-std=c99"])
    loaded = ctypes.CDLL(str(made))
    for function in (loaded.sample, loaded.plain):
        function.restype = ctypes.c_uint32
    return loaded


def sampled(library: ctypes.CDLL, angle: float, at: int) -> tuple[int, float]:
    estimate = ctypes.c_double()
    status = library.sample(ctypes.c_double(angle), ctypes.c_uint32(at), ctypes.byref(estimate))
    return status, estimate.value


def plain(library: ctypes.CDLL, angle: float) -> tuple[int, float]:
    estimate = ctypes.c_double()
    return library.plain(ctypes.c_double(angle), ctypes.byref(estimate)), estimate.value


@pytest.mark.parametrize(
    "first", [0, 2**32 - 5 * PERIOD - 200], ids=["from zero", "over the end of the counter"]
)
def test_samples_in_time_are_those_of_the_plain_step(library: ctypes.CDLL, first: int) -> None:
    angles = [0.001 * k for k in range(12)]
    library.begin()
    expected = [plain(library, angle) for angle in angles]
    library.begin()
    jitter = [0, 300, -200, 0, 450, 0, -300, 100, 0, 0, 200, 0]
    given = [
        sampled(library, angle, (first + k * PERIOD + late) % 2**32)
        for k, (angle, late) in enumerate(zip(angles, jitter, strict=True))
    ]
    assert given == expected
    assert len({estimate for _, estimate in given}) > 10


def test_a_sample_that_comes_twice_is_not_computed_twice(library: ctypes.CDLL) -> None:
    library.begin()
    first = sampled(library, 0.01, 0)
    second = sampled(library, 0.02, PERIOD)
    assert sampled(library, 0.9, PERIOD) == (SAMPLE_REPEATED, second[1])
    assert sampled(library, 0.9, PERIOD + 499) == (SAMPLE_REPEATED, second[1])
    third = sampled(library, 0.03, 2 * PERIOD)
    library.begin()
    assert [plain(library, angle) for angle in (0.01, 0.02, 0.03)] == [first, second, third]


def test_a_late_sample_is_one_after_missing_readings(library: ctypes.CDLL) -> None:
    library.begin()
    sampled(library, 0.0, 0)
    sampled(library, 0.0, PERIOD)
    # 20 rad/s: 0.02 rad a sample. Four samples are lacking, so that 0.09 rad can be true.
    status, _ = sampled(library, 0.09, 6 * PERIOD)
    assert status == SAMPLE_LATE | RECOVERED | index_bit(0)
    assert sampled(library, 0.09, 7 * PERIOD)[0] == 0
    library.begin()
    sampled(library, 0.0, 0)
    sampled(library, 0.0, PERIOD)
    assert sampled(library, 0.09, 2 * PERIOD)[0] & index_bit(0)
    # A whole minute without a sample admits any reading.
    assert sampled(library, 1.0, 60_000 * PERIOD)[0] == SAMPLE_LATE | RECOVERED | index_bit(0)


def test_before_init_nothing_is_computed_whatever_the_time(library: ctypes.CDLL) -> None:
    library.begin()
    sampled(library, 0.3, 0)
    library.wipe()
    assert sampled(library, 0.3, 10) == (NOT_STARTED, 0.0)
    assert sampled(library, 0.3, 10) == (NOT_STARTED, 0.0)
