"""Every command that evaluates a law says where its stated range is left, and where a contour ends."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_template import load_template
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.feedback.analysis import ranges_at_rest
from nlsdesign.foundation.deck import read_deck
from nlsdesign.model import flatten
from nlsdesign.regeneration import range_remarks
from tests.command_line import Run
from tests.command_line import run as run

LENGTH, RADIUS = 0.02, 0.01
PULLEY = """
[deck]
name = "pulley"
[motor]
component = "GearedMotor"
inertia = {value = 1e-3, unit = "kg*m^2", source = "test"}
gear_ratio = {value = 10, unit = "1", source = "test"}
torque_constant = {value = 30, unit = "mN*m/A", source = "test"}
[load]
component = "Fixed"
[spring]
component = "Through"
between = ["motor", "load"]
[spring.cam]
component = "Pulley"
radius = {value = 10, unit = "mm", source = "test"}
[spring.rubber]
component = "Specimen"
area = {value = 20, unit = "mm^2", source = "test"}
rest_length = {value = 20, unit = "mm", source = "test"}
[spring.rubber.law]
component = "NeoHooke"
shear_modulus = {value = 0.4, unit = "MPa", source = "test"}
"""
NEO_HOOKE = """
[spring.rubber.stiff]
component = "NeoHooke"
shear_modulus = {value = 0.4, unit = "MPa", source = "test"}
"""


def test_the_angle_where_a_range_ends_follows_from_the_radius() -> None:
    """ε = r·θ/L₀ on a pulley, so a range of 0.4 ends at θ = 0.4·L₀/r."""
    model = flatten(declare(read_deck(PULLEY, Path("pulley.toml"))))
    end = 0.4 * LENGTH / RADIUS
    inside = np.linspace(-end, end, 11)
    assert ranges_at_rest(model, inside, angle="motor.angle") == ()
    beyond = np.array([0.0, 0.99 * end, 1.01 * end, 1.5 * end])
    (left,) = ranges_at_rest(model, beyond, angle="motor.angle")
    assert (left.name, left.part) == ("spring.rubber.law.strain", "spring.rubber.law")
    assert (left.first, left.last) == (beyond[2], beyond[3])
    assert left.furthest == pytest.approx(0.6)
    assert (left.minimum, left.maximum) == (-0.4, 0.4)
    assert f"from {math.degrees(1.01 * end):.3g}° to {math.degrees(1.5 * end):.3g}°" in str(left)


@pytest.fixture
def stretched(tmp_path: Path) -> str:
    """The template with a law that is stated to hold to a strain of 0.4, stretched further."""
    text = load_template("cam-actuator").text.replace(
        "rest_length = {value = 40.0", "rest_length = {value = 15.0"
    )
    path = tmp_path / "own.toml"
    path.write_text(text + NEO_HOOKE, encoding="utf8")
    return str(path)


COMMANDS = {
    "analyse angle": ("--to", "50 deg", "--count", "3"),
    "observer": ("--kind", "cascade"),
    "export c": ("--kind", "cascade"),
    "export controller": (),
    "export fmu": ("--what", "plant"),
    "design": ("--maximum", "0.5N*m", "--angle", "40deg", "--starts", "1", "--draws", "0"),
}


LONG = ("analyse angle", "export c", "export controller", "design")


@pytest.mark.parametrize(
    "command", [pytest.param(each, marks=[pytest.mark.slow] * (each in LONG)) for each in COMMANDS]
)
def test_each_command_says_which_law_leaves_which_range_and_what_to_do(
    run: Run, stretched: str, command: str
) -> None:
    words = (*command.split(), "--deck", stretched, *COMMANDS[command], "--out", "out/o")
    status, out, err = run(*words)
    assert status in (0, 1), err
    assert "warning: spring.rubber.stiff.strain leaves [-0.4, 0.4]" in err
    assert "(NeoHooke) -> take a law that is stated to hold so far" in err
    assert "warning" not in out


def test_inside_its_range_a_law_is_not_spoken_of() -> None:
    machine = declare(load_template("cam-actuator").deck)
    assert range_remarks(machine) == []
    assert range_remarks(machine, first=0.0, last=math.radians(50.0)) == []


def test_beyond_the_contour_the_end_is_named() -> None:
    finger = declare(load_template("one-sided-finger").deck)
    (remark,) = range_remarks(finger, first=0.0, last=math.radians(80))
    assert "the contour of spring.cam ends at 60°, the angles go to 80°" in remark
    # An end that is printed alike is the same one.
    assert range_remarks(finger, first=0.0, last=math.radians(60.001)) == []
    assert range_remarks(finger, first=0.0, last=math.radians(60.02)) != []


@pytest.mark.slow
def test_angles_beyond_the_end_of_a_contour_are_named(run: Run, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(load_template("cam-actuator").text, encoding="utf8")
    status, out, err = run("analyse", "--deck", "own.toml", "--to", "200 deg", "--count", "3", "--json")
    (remark,) = [each for each in json.loads(out)["warnings"] if "contour" in each]
    assert status == 0
    assert "the contour of spring.cam ends at 60°, the angles go to 200°" in remark
    assert "-> stay within it (--to)" in remark
    assert f"warning: {remark}" in err
