"""Small parts of the export, each by itself: infinities as C text, first outputs, test inputs, icon."""

from __future__ import annotations

import struct
import zlib

import casadi as ca
import numpy as np
import pytest

from nlsdesign.export.c.c_text import Real
from nlsdesign.export.c.guarded_step import first_outputs
from nlsdesign.export.c.programs import sample_inputs
from nlsdesign.export.fmi.fmu_documentation import icon
from nlsdesign.model.flat import FlatModel, Variable


def inverse(start: float) -> FlatModel:
    """Keeps its state; gives out five times it and its inverse; its input lies between 2 and 6."""
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    nothing = ca.SX(0, 1)
    return FlatModel(
        name="inverse",
        description="",
        states=(Variable("x", "1", "", start),),
        inputs=(Variable("u", "1", "", 3.0, minimum=2.0, maximum=6.0),),
        parameters=(),
        outputs=(Variable("five", "1", ""), Variable("inverse", "1", "")),
        signals=(),
        equations=ca.Function(
            "equations",
            [ca.SX.sym("time"), x, u, nothing, ca.SX(0, 1)],
            [x, ca.vertcat(5 * x, 1 / x), nothing, nothing],
        ),
        sample_time=1e-3,
    )


@pytest.mark.parametrize("real", [Real.DOUBLE, Real.FLOAT])
def test_an_infinite_constant_keeps_its_sign(real: Real) -> None:
    assert real.literal(float("inf")) == f"(({real})INFINITY)"
    assert real.literal(float("-inf")) == f"(-({real})INFINITY)"


def test_outputs_begin_at_those_of_the_start_or_zero_where_these_are_not_finite() -> None:
    assert first_outputs(inverse(0.5)) == [2.5, 2.0]
    assert first_outputs(inverse(0.0)) == [0.0, 0.0]


def test_the_inputs_of_the_self_test_sweep_the_range_of_the_input() -> None:
    given = sample_inputs(inverse(0.5), Real.DOUBLE)[:, 0]
    inside = given[np.isfinite(given) & (given >= 2.0) & (given <= 6.0)]
    assert len(inside) > 0.9 * len(given)
    assert np.min(inside) < 2.6
    assert np.max(inside) > 5.4
    assert np.any(given > 6.0)
    assert np.any(given < 2.0)


def test_the_icon_shows_a_cam_with_its_centre_and_the_cable_below() -> None:
    size = 96
    data = icon(size)
    length = data.index(b"IDAT") - 4
    (count,) = struct.unpack(">I", data[length : length + 4])
    rows = zlib.decompress(data[length + 8 : length + 8 + count])
    image = np.frombuffer(rows, np.uint8).reshape(size, 1 + 4 * size)[:, 1:].reshape(size, size, 4)
    # Places are shares of width and height, from the upper left corner.
    place = lambda across, down: tuple(image[int(down * size), int(across * size)])  # noqa: E731
    assert place(0.375, 0.5) == (255, 255, 255, 255)
    assert place(0.3, 0.45) == (38, 84, 124, 255)
    assert place(0.8, 0.775) == (200, 85, 61, 255)
    corners = [place(across, down) for across in (0.0, 0.99) for down in (0.0, 0.99)]
    assert corners == [(0, 0, 0, 0)] * 4
