"""Fig. 9 of Austin et al. 2015: torque that a load feels which is moved while no torque is wanted.

The amplitude of the load is not printed; ±10° is assumed. Points read off the vector figure, N·m rms.
"""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.components import Driven, Encoder
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.control import ClosedLoop, TorqueGains, torque_controller, zero_torque
from nlsdesign.deck import load_deck
from nlsdesign.model import FlatModel, Variable, flatten
from nlsdesign.model.transform import with_signal
from nlsdesign.observer import design_observer_with_details

FREQUENCIES = [0.5, 1.0, 2.0]
PUBLISHED = {
    "austin2015_soft_spring": [0.00994, 0.02304, 0.04830],
    "austin2015_stiff_spring": [0.01160, 0.02396, 0.04971],
    "austin2015_figure_consistent": [0.00522, 0.01112, 0.02252],
}


def moved(deck: str) -> tuple[FlatModel, FlatModel]:
    """The bench, on which observer and controller are designed, and the same with a driven load."""
    actuator = declare(load_deck(deck))
    bench = flatten(actuator, outputs=["motor.angle", "spring.torque"])
    encoder = Encoder(of="load.angle", quantum=bench.values["motor_encoder.quantum"])
    parts = dict(actuator.parts) | {"load": Driven(), "load_encoder": encoder}
    plant = flatten(assembly("moved", **parts), outputs=["motor.angle", "spring.torque"])
    deflection = Variable("spring.angle.measured", "rad", "deflection as both encoders read it")
    return bench, with_signal(
        plant, deflection, lambda n: n["motor_encoder.reading"] - n["load_encoder.reading"]
    )


def found(deck: str, gains: TorqueGains) -> np.ndarray:
    bench, plant = moved(deck)
    loop = ClosedLoop(
        plant=plant,
        observer=design_observer_with_details(bench).model,
        controller=torque_controller(bench, gains=gains),
        wires={
            "observer.motor.angle": "plant.spring.angle.measured",
            "controller.motor.angle": "plant.motor_encoder.reading",
        },
    )
    return zero_torque(loop, amplitude=np.radians(10.0), frequencies=FREQUENCIES, cycles=2)


@pytest.mark.parametrize("deck", ["austin2015_soft_spring", "austin2015_stiff_spring"])
def test_linear_springs_with_a_gain_of_32(deck: str) -> None:
    torque = found(deck, TorqueGains(proportional=32.0, integral=0.0))
    assert torque[1:] == pytest.approx(PUBLISHED[deck][1:], rel=0.06)
    # At 0.5 Hz the integrator of the paper, whose gain is not printed, takes something off.
    assert 0.75 * torque[0] < PUBLISHED[deck][0] < torque[0]


def test_the_nonlinear_spring_with_a_gain_of_70_up_to_one_hertz() -> None:
    deck = "austin2015_figure_consistent"
    torque = found(deck, TorqueGains(proportional=70.0, integral=100.0))
    assert torque[:2] == pytest.approx(PUBLISHED[deck][:2], rel=0.15)
    # From 2 Hz on the model stays below the figure: the load moves within the dead zone of the cam.
    assert 0.6 * PUBLISHED[deck][2] < torque[2] < PUBLISHED[deck][2]
