"""Which records are held out when nobody has chosen: those that the others surround."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nlsdesign.bench.identification.records.measurement import surrounded
from nlsdesign.simulation import Trace

TIME = np.arange(2000) * 1e-3


def sine(size: float, frequency: float = 2.0, *, time: np.ndarray = TIME) -> Trace:
    wave = size * np.sin(2.0 * np.pi * frequency * time)
    return Trace(time, {"angle": wave, "torque": 3.0 * wave}, {"angle": "rad", "torque": "N*m"}, "sine")


def staircase(size: float) -> Trace:
    steps = size * np.round(2.0 * np.sin(2.0 * np.pi * 2.0 * TIME)) / 2.0
    return Trace(TIME, {"angle": steps, "torque": 3.0 * steps}, {"angle": "rad", "torque": "N*m"}, "stairs")


def held_out(*traces: Trace) -> set[int]:
    return set(surrounded(traces))


@pytest.mark.parametrize(("count", "held"), [(2, 1), (3, 1), (4, 1), (5, 2), (7, 2), (8, 3)])
def test_a_third_is_held_out_rounded_and_at_least_one_of_two(count: int, held: int) -> None:
    assert len(held_out(*(sine(0.1 * (k + 1)) for k in range(count)))) == held


def test_of_two_records_that_are_alike_the_one_inside_the_range_is_held_out() -> None:
    sizes = (0.2, 0.55, 0.6, 1.0)
    for order in itertools.permutations(range(4)):
        (place,) = held_out(*(sine(sizes[k]) for k in order))
        assert sizes[order[place]] in (0.55, 0.6)


@pytest.mark.parametrize("alone", [sine(1.0, 0.5), sine(0.2, 20.0), staircase(0.5)])
def test_the_only_record_of_its_kind_is_fitted_to(alone: Trace) -> None:
    alike = [sine(size) for size in (0.45, 0.5, 0.55, 0.6)]
    assert 4 not in held_out(*alike, alone)
    assert 0 not in held_out(alone, *alike)


def test_the_ends_of_the_range_are_fitted_to() -> None:
    sizes = (0.2, 0.4, 0.5, 0.6, 1.0)
    assert held_out(*(sine(size) for size in sizes)).isdisjoint({0, 4})


def test_a_record_that_is_longer_than_the_others_is_fitted_to() -> None:
    long = sine(0.5, time=np.arange(20_000) * 1e-3)
    assert 0 not in held_out(long, sine(0.45), sine(0.5), sine(0.55))
