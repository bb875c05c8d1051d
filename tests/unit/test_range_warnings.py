"""A law that is used beyond its stated range says so in results, and keeps silent inside it."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from nlsdesign.components import DrivenPoint, LinearElastic, NeoHooke, Spring, assembly, specimen, tie
from nlsdesign.model import Variable, flatten
from nlsdesign.simulation import Trace, range_warnings, simulate
from tests.stretched import LENGTH, pulled, run

TIMES = np.linspace(0.0, 1.0, 101)


def stretched_to(most: float) -> Trace:
    """A slow half sine of the strain on a neo-Hookean piece, whose law holds to 0.4."""
    model = pulled(law=NeoHooke(shear_modulus=0.4e6))
    w = math.pi
    return run(model, TIMES, lambda t: most * math.sin(w * t), lambda t: most * w * math.cos(w * t))


def test_inside_the_range_nothing_is_said() -> None:
    trace = stretched_to(0.39)
    assert trace.warnings == ()
    assert "warning" not in str(trace)


def test_the_first_time_outside_and_the_furthest_value_are_named() -> None:
    trace = stretched_to(0.8)
    (found,) = trace.warnings
    assert found.name == "rubber.law.strain"
    assert (found.minimum, found.maximum) == (-0.4, 0.4)
    assert found.time == pytest.approx(0.17), "sin(πt) passes one half at t = 1/6 s"
    assert found.furthest == pytest.approx(0.8)
    assert "rubber.law.strain leaves [-0.4, 0.4]" in str(trace)
    assert "t = 0.17 s" in str(trace)
    assert "0.8" in str(trace)


def test_compression_counts_too_and_copies_keep_the_warning() -> None:
    trace = stretched_to(-0.5)
    assert trace.warnings[0].furthest == pytest.approx(-0.5)
    assert trace.with_signals({}, {}).warnings == trace.warnings
    assert trace.at(TIMES[:5]).warnings == trace.warnings
    assert pickle.loads(pickle.dumps(trace.warnings)) == trace.warnings


def test_the_range_stands_on_the_signal_of_the_law_and_nowhere_else() -> None:
    model = pulled(law=NeoHooke(shear_modulus=0.4e6), other=LinearElastic(modulus=1e5))
    bounded = {v.name for v in model.signals + model.states if math.isfinite(v.maximum)}
    assert bounded == {"rubber.law.strain"}


def test_a_member_in_series_is_watched_by_its_own_strain() -> None:
    """Soft Hooke and stiff neo-Hooke in series: the soft one takes the strain, so no range is left."""
    inside = pulled(law=NeoHooke(shear_modulus=0.4e6))
    assert simulate(inside, TIMES, inputs={"grip.position": 0.6 * LENGTH}).warnings
    piece = specimen(area=1e-4, rest_length=LENGTH, law=NeoHooke(shear_modulus=0.4e6))
    chain = {"soft": Spring(stiffness=100.0), "piece": piece}
    from nlsdesign.components import series

    made = assembly("chain", grip=DrivenPoint(), line=tie(series(**chain), "grip"))
    trace = simulate(flatten(made), TIMES, inputs={"grip.position": 0.6 * LENGTH})
    assert trace.warnings == ()
    assert 0.0 < trace["line.piece.law.strain"][0] < 0.1


def test_rounding_at_the_edge_is_no_warning_but_a_small_excess_is() -> None:
    variable = Variable("a.strain", "1", "strain", minimum=0.0)
    time = np.array([0.0, 1.0])
    assert range_warnings([variable], time, {"a.strain": np.array([0.0, -1e-12])}) == ()
    (found,) = range_warnings([variable], time, {"x.a.strain": np.array([0.0, -1e-6])}, "x.")
    assert found.name == "x.a.strain"
    assert found.time == 1.0
