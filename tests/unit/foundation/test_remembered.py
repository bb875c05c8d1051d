"""What cannot change is built once for equal questions, and anew for any other."""

from __future__ import annotations

from dataclasses import replace

import nlsdesign as nls
from nlsdesign.components import ROTATION, Inertia, Spring, assembly, tie
from nlsdesign.feedback.observer import CascadeGain, FixedGrid
from nlsdesign.feedback.observer.scheduling.scheduled import design_observer_with_details
from nlsdesign.foundation.symbolic import remembered


def test_the_last_results_are_handed_out_again_and_no_more_are_kept() -> None:
    asked = []

    @remembered(2)
    def pair(first: object, second: object = 0) -> tuple[object, object]:
        """Return both."""
        asked.append(first)
        return first, second

    assert pair(1) is pair(1)
    assert pair(1, second=2) == (1, 2)
    assert asked == [1, 1]
    others = list(range(3, 40))  # more than any test keeps
    for other in others:
        pair(other)
    pair(1)
    assert asked == [1, 1, *others, 1]
    assert pair.__doc__ == "Return both."


def test_what_may_change_is_asked_again() -> None:
    @remembered(2)
    def size(of: list[int], *, more: int = 0) -> int:
        return len(of) + more

    row = [1]
    assert size(row) == 1
    row.append(2)
    assert size(row) == 2
    assert size(row, more=3) == 5


def swing(stiffness: float) -> nls.components.Assembly:
    spring = tie(Spring(stiffness=stiffness, domain=ROTATION), "wheel")
    return assembly("swing", wheel=Inertia(inertia=1e-3), spring=spring)


def test_equal_assemblies_have_one_flat_model() -> None:
    assert nls.flatten(swing(2.0)) is nls.flatten(swing(2.0))
    assert nls.flatten(swing(2.0)).values["spring.stiffness"] == 2.0
    assert nls.flatten(swing(3.0)).values["spring.stiffness"] == 3.0
    named = nls.flatten(swing(2.0), outputs=["wheel.angle"])
    assert [v.name for v in named.outputs] == ["wheel.angle"]
    assert [v.name for v in nls.flatten(swing(2.0)).outputs] == ["spring.torque"]
    given = swing(2.0).quantities()["spring.stiffness"]
    sourced = swing(2.0).with_values({"spring.stiffness": replace(given, source="weighed")})
    assert nls.flatten(sourced) is not nls.flatten(swing(2.0)), "the source of a number is written with it"


def test_an_observer_is_designed_once_for_its_model_gain_and_grid() -> None:
    plant = nls.flatten(nls.declare(nls.load_deck("austin2015_soft_spring")))
    grid = FixedGrid(-0.5, 0.5, points=5)
    one, again, other = (
        design_observer_with_details(plant, gain=gain, grid=grid, sample_time=time)
        for gain, time in ((CascadeGain(), 1e-3), (CascadeGain(), 1e-3), (CascadeGain(), 2e-3))
    )
    assert one is again
    assert one.model.sample_time == 1e-3
    assert other.model.sample_time == 2e-3
    assert nls.torque_controller(plant) is nls.torque_controller(plant)
    assert nls.torque_controller(plant, sample_time=2e-3).sample_time == 2e-3
