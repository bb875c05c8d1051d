"""The closed loop in one piece: wiring, delay, and the plant between the samples."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.components import Driven
from nlsdesign.feedback.control import (
    REPRODUCED_GAINS,
    ClosedLoop,
    TorqueGains,
    loop_margins,
    sine_response,
    torque_controller,
    tracking,
    zero_torque,
)
from nlsdesign.feedback.control.evaluation.linear_loop import linear_loop
from nlsdesign.feedback.observer import FixedGrid, design_observer_with_details, observe
from nlsdesign.foundation.errors import ArrangementError, ConvergenceError, UnknownNameError, ValueRangeError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import simulate
from tests import observed as ob

DESIRED = "controller.spring.torque.desired"


@pytest.fixture(scope="module")
def plant() -> FlatModel:
    return ob.bench(ob.SLOW, friction=0.02)


@pytest.fixture(scope="module")
def loop(plant: FlatModel) -> ClosedLoop:
    observer = design_observer_with_details(plant, grid=FixedGrid(-1.2, 1.2, points=241)).model
    controller = torque_controller(plant, gains=REPRODUCED_GAINS)
    return ClosedLoop(plant=plant, observer=observer, controller=controller, wires=ob.WIRES)


def wanted(time: float) -> float:
    return 0.3 * np.sin(2.0 * np.pi * 1.5 * time)


def changed(loop: ClosedLoop, **changes: object) -> ClosedLoop:
    kept = {
        name: getattr(loop, name)
        for name in ("plant", "observer", "controller", "wires", "delay", "substeps")
    }
    return ClosedLoop(**(kept | changes))


def test_the_plant_is_integrated_as_cvodes_would(loop: ClosedLoop) -> None:
    trace = loop.run(0.4, inputs={DESIRED: wanted})
    current = trace["plant.motor.current"]
    assert np.ptp(current) > 0.5
    exact = simulate(loop.plant, trace.time, inputs={"motor.current": current}, hold=True, tolerance=1e-10)
    for name in ("motor.angle", "motor.speed", "spring.torque", ob.STRAIN):
        size = np.max(np.abs(exact[name]))
        assert np.max(np.abs(trace[f"plant.{name}"] - exact[name])) < 2e-6 * size, name


def test_observer_and_controller_are_stepped_as_models(loop: ClosedLoop) -> None:
    """Fed with the record, the simulated observer and controller give what they gave in the loop."""
    trace = loop.run(0.3, inputs={DESIRED: wanted})
    heard = trace.with_signals(
        {"motor.angle": trace["plant.motor_encoder.reading"], "motor.current": trace["plant.motor.current"]},
        {"motor.angle": "rad", "motor.current": "A"},
    )
    again = observe(loop.observer, heard)
    for name in ("spring.torque", "motor.speed", "motor.angle.innovation"):
        assert np.max(np.abs(again[name] - trace[f"observer.{name}"])) < 1e-12, name
    inputs = {
        "spring.torque.desired": np.array([wanted(t) for t in trace.time]),
        "spring.torque": trace["observer.spring.torque"],
        "motor.angle": trace["plant.motor_encoder.reading"],
    }
    currents = simulate(loop.controller, trace.time, inputs=inputs)["motor.current"]
    assert currents == pytest.approx(trace["controller.motor.current"], abs=1e-12)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_the_current_acts_after_its_delay(loop: ClosedLoop, delay: int) -> None:
    trace = changed(loop, delay=delay).run(0.05, inputs={DESIRED: 0.2})
    computed, acting = trace["controller.motor.current"], trace["plant.motor.current"]
    assert np.all(acting[:delay] == 0.0)
    assert np.array_equal(acting[delay:], computed[: len(computed) - delay])
    assert np.array_equal(trace["observer.motor.current"], acting)


def test_delay_costs_margin_sample_by_sample(loop: ClosedLoop) -> None:
    """What is lost is the delay margin; with three samples the loop of these gains limit-cycles."""
    margin = [loop_margins(changed(loop, delay=d), [0.5]).delay[0] for d in (0, 1, 2)]
    assert np.diff(margin) == pytest.approx([-1e-3, -1e-3], rel=1e-3)
    assert 2e-3 < margin[0] < 3e-3
    late = changed(loop, delay=3)
    assert not linear_loop(late, [0.5]).stable()[0]
    lost = sine_response(late, amplitude=0.8, frequencies=[6.0])
    assert lost.verdicts[0].state == "limit cycle"
    assert np.isnan(lost.phase_degrees[0])
    assert np.isnan(lost.distortion[0])


def test_start_values_are_taken(loop: ClosedLoop) -> None:
    trace = loop.run(0.01, inputs={DESIRED: 0.0}, start={"plant.motor.angle": 0.4})
    assert trace["plant.motor.angle"][0] == 0.4
    assert trace["observer.motor.angle"][0] == pytest.approx(0.4, abs=ob.COUNT)


def test_a_perfect_loop_has_no_error(loop: ClosedLoop) -> None:
    trace = loop.run(0.2, inputs={DESIRED: wanted})
    perfect = trace.with_signals({DESIRED: trace["plant.spring.torque"]}, {DESIRED: "N*m"})
    assert tracking(loop, perfect).rms_error == 0.0
    found = tracking(loop, trace, settled=0.1)
    late = trace.time >= 0.1
    error = (trace["plant.spring.torque"] - trace[DESIRED])[late]
    assert found.rms_error == pytest.approx(np.sqrt(np.mean(error**2)))
    assert found.largest_error == pytest.approx(np.max(np.abs(error)))
    with pytest.raises(ValueRangeError, match="the run ends"):
        tracking(loop, trace, settled=1.0)


def test_bad_wires_and_names(loop: ClosedLoop, plant: FlatModel) -> None:
    with pytest.raises(ArrangementError, match="must begin with"):
        changed(loop, wires={"observr.motor.angle": "plant.motor.angle"})
    with pytest.raises(UnknownNameError, match=r"did you mean 'plant\.motor_encoder\.reading'"):
        changed(loop, wires={"observer.motor.angle": "plant.motor_encoder.readin"}).run(
            0.01, inputs={DESIRED: 0.0}
        )
    with pytest.raises(UnknownNameError, match=r"did you mean 'controller\.spring\.torque\.desired'"):
        loop.run(0.01, inputs={"controller.spring.torque.desird": 0.0})
    with pytest.raises(ArrangementError, match=r"'controller\.spring\.torque\.desired'.*is open"):
        loop.run(0.01, inputs={})
    with pytest.raises(UnknownNameError, match=r"state of the loop 'plant\.motor\.angel'"):
        loop.run(0.01, inputs={DESIRED: 0.0}, start={"plant.motor.angel": 0.1})
    other = design_observer_with_details(plant, sample_time=2e-3, grid=FixedGrid(-1.2, 1.2, points=241)).model
    with pytest.raises(ValueRangeError, match="sampled alike"):
        changed(loop, observer=other)
    with pytest.raises(ValueRangeError, match="delay -1"):
        changed(loop, delay=-1)


def test_a_wire_from_a_variable_that_does_not_exist(loop: ClosedLoop) -> None:
    wires = ob.WIRES | {"controller.spring.torque": "observer.spring.tork"}
    with pytest.raises(UnknownNameError, match=r"did you mean 'observer\.spring\.torque'"):
        changed(loop, wires=wires).run(0.01, inputs={DESIRED: 0.0})


def test_a_loop_that_runs_away_gives_no_numbers(loop: ClosedLoop) -> None:
    """One Runge-Kutta step per sample is unstable for a damping of 50 N·m·s/rad on the printed inertia."""
    stiff = loop.plant.with_values({"bearing.damping": 50.0})
    with pytest.raises(ConvergenceError, match="use more substeps"):
        changed(loop, plant=stiff, substeps=1).run(
            5.0, inputs={DESIRED: wanted}, start={"plant.motor.speed": 1.0}
        )


def test_frequencies_are_checked(loop: ClosedLoop) -> None:
    with pytest.raises(ValueRangeError, match="500 Hz"):
        sine_response(loop, amplitude=0.1, frequencies=[600.0])
    with pytest.raises(ArrangementError, match=r"no body with a prescribed motion"):
        zero_torque(loop, amplitude=0.1, frequencies=[5.0])


def test_inputs_of_the_plant_run_linearly(loop: ClosedLoop) -> None:
    """A load that is moved: the torque it feels at standstill is that of the spring at its angle."""
    moved = flatten(ob.actuator(ob.SLOW, load=Driven()), outputs=["motor.angle", "spring.torque"])
    still = changed(
        loop,
        plant=moved,
        wires={"observer.motor.angle": "plant.spring.angle", "controller.motor.angle": "plant.motor.angle"},
        controller=torque_controller(moved, gains=TorqueGains(proportional=0.0, integral=0.0)),
    )
    trace = still.run(
        0.1, inputs={DESIRED: 0.0, "plant.load.angle": lambda t: -2.0 * t, "plant.load.speed": -2.0}
    )
    assert trace["plant.load.angle"][-1] == pytest.approx(-0.2)
    assert trace["plant.spring.angle"] == pytest.approx(
        trace["plant.motor.angle"] - trace["plant.load.angle"]
    )
    assert np.max(np.abs(trace["observer.spring.torque"] - trace["plant.spring.torque"])) < 5e-3
