"""Other coordinates of one model say the same; and the published form is what the paper prints, corrected."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.components import Driven, TransportDelay
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import ArrangementError, UnknownNameError
from nlsdesign.foundation.symbolic import depends
from nlsdesign.model import FlatModel, Variable, flatten
from nlsdesign.model.paper_form import paper_form
from nlsdesign.model.transform import (
    cut,
    named,
    replace_state,
    with_outputs,
    with_signal,
    without_idle_states,
)
from nlsdesign.simulation import Trace, simulate
from tests import observed as ob

TIMES = np.arange(0.0, 0.6, 1e-3)


def swing(model: FlatModel) -> Trace:
    return simulate(model, TIMES, inputs={"motor.current": lambda t: 1.5 * np.sin(9.0 * t)})


@pytest.fixture(scope="module")
def model() -> FlatModel:
    return ob.bench(ob.SLOW)


@pytest.fixture(scope="module")
def original(model: FlatModel) -> Trace:
    return swing(model)


@pytest.mark.parametrize("state", [ob.RELAXING_FORCE, ob.FORCE, "spring.rubber.relaxing.stress"])
def test_another_state_gives_the_same_trajectory(model: FlatModel, original: Trace, state: str) -> None:
    other = (
        ob.on_relaxing_force(model) if state == ob.RELAXING_FORCE else replace_state(model, ob.STRAIN, state)
    )
    assert [v.name for v in other.states] == ["motor.angle", "motor.speed", state]
    assert original["motor.angle"].max() > 0.3  # it does move, into the stiffening
    moved = swing(other)
    for name in ("motor.angle", "motor.speed", "spring.torque", ob.STRAIN, ob.FORCE):
        size = np.max(np.abs(original[name]))
        assert np.max(np.abs(moved[name] - original[name])) < 2e-6 * size, name


def test_the_start_of_the_new_state_is_that_of_the_old_one(model: FlatModel) -> None:
    loaded = model.with_values({"motor.angle": 0.5, ob.STRAIN: 0.01})
    other = replace_state(loaded, ob.STRAIN, ob.FORCE)
    start = loaded.evaluate(list(loaded.start(loaded.states)))
    assert other.variable(ob.FORCE).start == pytest.approx(start[ob.FORCE], rel=1e-12)


def test_the_relaxing_force_obeys_its_printed_equation(model: FlatModel) -> None:
    """dF_M/dt = a·k·h·ω − (k/η)·F_M."""
    other = ob.on_relaxing_force(model)
    angle, speed, force = 0.5, 2.0, 3.0
    found = other.evaluate([angle, speed, force])
    arm = found["spring.cam.lever_arm_now"]
    expected = ob.STIFF * ob.RELAXING * arm * speed - ob.RELAXING / ob.SLOW * force
    assert found[f"der({ob.RELAXING_FORCE})"] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("viscosity", [ob.PRINTED, ob.SLOW])
def test_the_published_form_is_the_corrected_printed_one(viscosity: float) -> None:
    """dF/dt = (Σk·H + k)·a·dδ/dt − (k/η)(F − F*(δ)) and J·dω/dt = n·k_T·I − N·h·F − b·ω."""
    form = paper_form(ob.bench(viscosity))
    assert [v.name for v in form.states] == [ob.FORCE, ob.EXTENSION, "motor.angle", "motor.speed"]
    assert [v.name for v in form.inputs] == [ob.RATE, "motor.current"]
    assert [v.name for v in form.outputs] == [ob.EXTENSION, "motor.angle"]
    for extension, angle in ((0.1e-3, 0.1), (0.7e-3, 0.3), (3.0e-3, 0.7), (6.0e-3, 1.2)):
        force, speed, rate, current = 17.0, -1.5, 0.02, 0.8
        found = form.evaluate([force, extension, angle, speed], [rate, current])
        relaxing = ob.RELAXING / viscosity * (force - ob.equilibrium_force(extension))
        expected = (ob.stiffness(extension) + ob.STIFF * ob.RELAXING) * rate - relaxing
        assert found[f"der({ob.FORCE})"] == pytest.approx(expected, rel=1e-9)
        pull = (
            ob.CONSTANT * current
            - ob.ELEMENTS * found["spring.cam.lever_arm_now"] * force
            - ob.DAMPING * speed
        )
        assert found["der(motor.speed)"] == pytest.approx(pull / ob.INERTIA, rel=1e-9)
        assert found[f"der({ob.EXTENSION})"] == rate


def test_the_published_form_follows_the_model_while_the_rate_is_the_true_one(
    model: FlatModel, original: Trace
) -> None:
    form = paper_form(model)
    for k in (50, 170, 333, 590):
        state = [original[n][k] for n in (ob.FORCE, ob.EXTENSION, "motor.angle", "motor.speed")]
        rate = original["spring.cam.lever_arm_now"][k] * original["motor.speed"][k]
        found = form.evaluate(state, [rate, original["motor.current"][k]])
        assert found["motor.acceleration"] == pytest.approx(
            original["motor.acceleration"][k], rel=1e-6, abs=1e-6
        )
        assert found[f"{ob.EXTENSION}.geometric"] == pytest.approx(original[ob.EXTENSION][k], rel=1e-9)
        slope = (original[ob.FORCE][k + 1] - original[ob.FORCE][k - 1]) / 2e-3
        assert found[f"der({ob.FORCE})"] == pytest.approx(slope, rel=0.01, abs=0.5)


def test_a_cut_removes_what_lies_before_it(model: FlatModel) -> None:
    opened = cut(model, [ob.EXTENSION])
    s = opened.symbols()
    force = named(opened, s)[ob.FORCE]
    angle, strain = s.state[0], s.state[2]
    assert not depends(force, angle)
    assert depends(force, strain)
    for extension in (0.1e-3, 2e-3, 5e-3):
        found = opened.evaluate([0.4, 0.0, 0.0], [0.0, extension])
        unrelaxed = ob.equilibrium_force(extension) + ob.STIFF * ob.RELAXING * extension
        assert found[ob.FORCE] == pytest.approx(unrelaxed, rel=1e-12)


def test_idle_states_leave_without_a_trace(original: Trace, model: FlatModel) -> None:
    parts = dict(ob.actuator(ob.SLOW).parts)
    sensor = TransportDelay(of=ob.FORCE, delay=2e-3)
    heard = flatten(assembly("heard", **parts, cell=sensor), outputs=["motor.angle", "cell.reading"])
    assert len(heard.states) == 5
    bare = without_idle_states(heard, ["spring.torque"])
    assert [v.name for v in bare.states] == ["motor.angle", "motor.speed", ob.STRAIN]
    assert "cell.reading" not in {v.name for v in bare.signals}
    assert np.max(np.abs(swing(bare)["spring.torque"] - original["spring.torque"])) < 1e-6


def test_a_driven_motor_leaves_the_rubber_alone() -> None:
    parts = {n: Driven() if n == "motor" else p for n, p in ob.actuator().parts}
    kept = {n: parts[n] for n in ("motor", "load", "spring")}
    model = flatten(assembly("driven", **kept), outputs=["spring.torque"])
    assert [v.name for v in model.states] == [ob.STRAIN]
    with pytest.raises(ArrangementError, match=r"needs the driven body .* no body free to move"):
        paper_form(model)


@pytest.mark.parametrize(
    ("old", "signal", "reason"),
    [
        ("motor.angle", ob.FORCE, "not affine"),
        (ob.STRAIN, "spring.torque", "does not change with the state at the start"),
        (ob.STRAIN, "motor.acceleration", "depends on an input"),
    ],
)
def test_a_signal_that_cannot_be_a_state(model: FlatModel, old: str, signal: str, reason: str) -> None:
    with pytest.raises(ArrangementError, match=reason):
        replace_state(model, old, signal)


def test_names_that_do_not_exist(model: FlatModel) -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean 'spring\.rubber\.force'"):
        replace_state(model, ob.STRAIN, "spring.ruber.force")
    with pytest.raises(UnknownNameError, match=r"state 'motor\.angel'"):
        replace_state(model, "motor.angel", ob.FORCE)
    with pytest.raises(UnknownNameError):
        with_outputs(model, ["spring.torqe"])
    with pytest.raises(UnknownNameError):
        cut(model, ["spring.rubber.fors"])


def test_a_cut_at_another_name_of_a_state_is_refused(model: FlatModel) -> None:
    with pytest.raises(ArrangementError, match="only another name"):
        cut(model, ["spring.angle"])


def test_a_taken_name_is_refused(model: FlatModel) -> None:
    with pytest.raises(ArrangementError, match="is taken"):
        with_signal(model, Variable(ob.FORCE, "N", "again"), lambda n: n[ob.FORCE])
