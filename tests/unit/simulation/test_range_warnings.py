"""A law that is used beyond its stated range says so in results, and keeps silent inside it."""

from __future__ import annotations

import json
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from nlsdesign.cli.main import program
from nlsdesign.components import (
    TRANSLATION,
    Driven,
    LinearElastic,
    NeoHooke,
    Spring,
    StrainStiffening,
    series,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import Variable, flatten
from nlsdesign.simulation import Trace, range_warnings, simulate
from tests.stretched import LENGTH, deck_head, pulled, run, stress_at

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
    made = assembly("chain", grip=Driven(domain=TRANSLATION), line=tie(series(**chain), "grip"))
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


DECK = (
    deck_head("pulled", area=100)
    + """[rubber.law]
component = "NeoHooke"
shear_modulus = {value = 0.4, unit = "MPa", source = "test"}
[cell]
component = "ForceSensor"
of = "rubber.force"
"""
)


@pytest.mark.parametrize(("most", "said"), [(0.3, False), (0.8, True)])
def test_the_command_line_says_where_a_record_leaves_the_range(
    tmp_path: Path, most: float, said: bool
) -> None:
    (tmp_path / "deck.toml").write_text(DECK, encoding="utf8")
    records, out = tmp_path / "records", str(tmp_path / "out.csv")
    records.mkdir()
    times = np.linspace(0.0, 2.0, 401)
    position = LENGTH * most * np.sin(np.pi * times / 2) ** 2
    force = 1e-4 * stress_at(pulled(law=NeoHooke(shear_modulus=0.4e6)), list(position / LENGTH))
    columns = np.column_stack([times, position, force])
    head = "time [s],grip.position [m],cell.reading [N]"
    for name in ("again", "pull", "third"):
        np.savetxt(records / f"{name}.csv", columns, delimiter=",", header=head, comments="")
    arguments = ["simulate", "--deck", str(tmp_path / "deck.toml"), "--record", str(records / "pull.csv")]
    result = CliRunner().invoke(program, [*arguments, "--out", out])
    assert result.exit_code == 0, result.output
    assert ("warning: rubber.law.strain leaves [-0.4, 0.4]" in result.output) is said
    as_json = CliRunner().invoke(program, [*arguments, "--out", str(tmp_path / "out.csv"), "--json"])
    assert bool(json.loads(as_json.output)["warnings"]) is said


def test_a_piecewise_law_of_tension_says_when_it_is_compressed() -> None:
    model = pulled(law=StrainStiffening(modulus=(1e6,), knots=(0.0,)))
    pressed = run(model, TIMES, lambda t: -0.1 * t, lambda t: -0.1)
    assert [w.name for w in pressed.warnings] == ["rubber.law.strain"]
    assert run(model, TIMES, lambda t: 0.1 * t, lambda t: 0.1).warnings == ()
