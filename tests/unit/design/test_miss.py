"""A miss is not a success: what is said of it, what is refused, what a stock gives."""

from __future__ import annotations

import re
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components import OneSidedCam, through, tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.design import (
    AtMost,
    CamDesign,
    DesignSettings,
    LeastMass,
    MaximumCableTension,
    MaximumCamRadius,
    MaximumStrain,
    MaximumStress,
    MinimumRadiusOfCurvature,
    NumberRange,
    OverTravel,
    PowerTorque,
    PretensionRange,
    Stock,
    TabulatedTorque,
    TorqueBand,
    TorqueWithin,
    design_cam,
    safe_limits,
)
from nlsdesign.design.optimisation.limits import Bound
from nlsdesign.design.optimisation.loosening import Give
from nlsdesign.design.optimisation.result import Miss
from nlsdesign.design.optimisation.shape import starts
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import InfeasibleError, UnitError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import degrees, quantity
from nlsdesign.model import flatten
from tests.cam_cases import CONCAVE, CONTOUR, KEEP, PRETENSION, RUBBER, TARGET, actuator

LINE = PowerTorque(coefficient=3.4, exponent=1.0, angle=degrees(50.0))
WHOLE = DesignSettings(look_for_size_ranges=False, draws=0)
QUICK = replace(WHOLE, starts=2)
ONCE = replace(WHOLE, starts=1, look_for_remedies=False)


def test_a_miss_says_how_far_where_why_and_what_to_free() -> None:
    """Without pretension a cable through the centre gives no stiffness at zero: 243 mN·m are left."""
    missed = design_cam(actuator(CONCAVE), target=TARGET, free=CONTOUR, keep=KEEP, settings=QUICK)
    assert not missed.met
    assert missed.miss is not None
    assert missed.miss.error == pytest.approx(missed.rms / 5.0)
    worst = np.argmax(np.abs(missed.check.errors))
    assert missed.miss.worst_angle == missed.check.angles[worst]
    assert missed.miss.worst_error == missed.check.errors[worst]
    assert "MISSES ITS TARGET: 4.86 % rms" in str(missed)
    assert "radius of curvature (MinimumRadiusOfCurvature)" in missed.miss.binding
    assert missed.miss.remedies is not None
    freed = {each.names: each for each in missed.miss.remedies.enough}
    assert ("spring.pretension",) in freed
    # What is promised comes true when the name is freed: 22 mN·m.
    promised = freed[("spring.pretension",)]
    assert promised.error is not None
    then = design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=KEEP, settings=QUICK)
    assert then.met
    assert then.rms <= 1.05 * promised.error


@pytest.mark.slow
def test_the_largest_error_is_the_designers() -> None:
    strict = DesignSettings(look_for_size_ranges=False, largest_error=0.004)
    design = design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=KEEP, settings=strict)
    assert not design.met, "22 mN·m are 0.44 %"
    with pytest.raises(ValueRangeError, match="largest_error"):
        DesignSettings(largest_error=0.0)
    with pytest.raises(ValueRangeError, match="starts = 0: a search has from 1"):
        DesignSettings(starts=0)


def test_a_number_without_influence_is_refused_by_name() -> None:
    """At rest the viscosity has no effect: any value would do."""
    published = declare(load_deck("austin2015_as_printed"))
    viscosity = "spring.rubber.relaxing.dashpot.viscosity"
    with pytest.raises(ValueRangeError, match=rf"'{viscosity}'.*neither a goal nor a limit"):
        design_cam(published, target=TARGET, free=[*CONTOUR, viscosity], keep=KEEP)
    with pytest.raises(ValueRangeError, match=r"'motor\.gear_ratio'"):
        design_cam(published, target=TARGET, free=[*CONTOUR, "motor.gear_ratio"], keep=KEEP)


@pytest.mark.slow
def test_a_conflict_says_which_number_to_free() -> None:
    """With 3 mm of pretension on 12.5 mm the strain begins at 0.24: only the pretension is to blame."""
    keep = [MinimumRadiusOfCurvature(1e-3), MaximumCamRadius(20e-3), MaximumStrain(0.2)]
    tight = actuator(CONCAVE, pretension=3e-3)
    with pytest.raises(InfeasibleError, match=r"free spring\.pretension \(to ") as caught:
        design_cam(tight, target=TARGET, free=CONTOUR, keep=keep)
    assert "MaximumStrain" in str(caught.value)
    design_cam(tight, target=TARGET, free=PRETENSION, keep=keep, settings=WHOLE)


@pytest.mark.slow
def test_declared_strength_and_cable_are_limits_unless_others_are_asked_for() -> None:
    published = declare(load_deck("austin2015_as_printed"))
    values = flatten(published).values
    names = {type(limit): limit for limit in safe_limits(flatten(published))}
    tension = values["spring.cam.cable_breaking_force"] / 5.0
    assert names[MaximumCableTension] == MaximumCableTension(tension)
    assert names[MaximumStress] == MaximumStress(values["spring.rubber.tensile_strength"], safety_factor=3.0)
    free = [*RUBBER]
    design = design_cam(published, target=TARGET, free=free, keep=[MaximumCamRadius(20e-3)], settings=ONCE)
    assert design.curves.forces.max() <= tension * (1 + 1e-6)
    assert design.curves.stresses["spring.rubber"].max() <= 5.17e6 / 3 * (1 + 1e-6)
    kinds = [state.limit for state in design.limits]
    assert kinds.count("MaximumCableTension") == 1
    looser = [MaximumCamRadius(20e-3), MaximumCableTension(1000.0)]
    other = design_cam(published, target=TARGET, free=free, keep=looser, settings=ONCE)
    assert [state.bound for state in other.limits if state.limit == "MaximumCableTension"] == [1000.0]
    bare = replace(ONCE, defaults=())
    unlimited = design_cam(published, target=TARGET, free=PRETENSION, keep=[], settings=bare)
    assert unlimited.limits == ()
    assert any("MaximumCableTension" in remark for remark in unlimited.remarks)


@pytest.mark.slow
def test_starts_are_reproducible_by_seed() -> None:
    def run(seed: int) -> list[float]:
        settings = DesignSettings(starts=2, seed=seed, look_for_size_ranges=False, draws=0)
        design = design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=KEEP, settings=settings)
        return [start.cost for start in design.starts]

    first, again, other = run(1), run(1), run(2)
    assert first == again
    assert min(first) == pytest.approx(min(other), rel=5e-4)
    drawn = [list(starts(6, seed, ["spring.rubber.area"])) for seed in (1, 1, 2)]
    assert drawn[0] == drawn[1]
    assert drawn[0][:4] == drawn[2][:4]
    assert not any(one == two for one, two in zip(drawn[0][4:], drawn[2][4:], strict=True))


@pytest.mark.slow
def test_ranges_of_sizes_that_cost_nothing_are_true() -> None:
    """At both ends the target is still met, the other sizes following."""
    design = design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=KEEP)
    area = next(each for each in design.size_ranges if each.name == "spring.rubber.area")
    assert area.lowest is not None
    assert area.highest is not None
    assert area.lowest < design.values["spring.rubber.area"].number < area.highest
    for end in (area.lowest, area.highest):
        moved = actuator(CONCAVE).with_values({"spring.rubber.area": end})
        free = [name for name in RUBBER if name != "spring.rubber.area"]
        there = design_cam(moved, target=TARGET, free=free, keep=KEEP, settings=WHOLE)
        assert there.rms < 1.2e-3 * TARGET.largest


@pytest.mark.slow
def test_a_stock_is_gone_through_and_listed() -> None:
    elements = Stock("spring.cam.elements", (1, 2, 4))
    keep = [*KEEP, MaximumCableTension(100.0)]
    design = design_cam(actuator(CONCAVE), target=TARGET, free=[*RUBBER, elements], keep=keep, settings=WHOLE)
    assert design.met
    assert len(design.alternatives) == 3
    assert not design.alternatives[0].met, "one element at 100 N and 20 mm gives 2 N·m at most"
    assert design.values["spring.cam.elements"].number == 4.0
    # The design has a name of its own and names what it was made from.
    assert actuator(CONCAVE).with_values(design.values).parts == design.actuator.parts


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: Stock("spring.rubber.area", ()), ValueRangeError, "empty list"),
        (lambda: Stock("spring.rubber.area", (1e-4, 1e-4)), ValueRangeError, "twice"),
        (lambda: Stock("spring.cam.elements", (2, 2.5)), ValueRangeError, "elements are counted"),
        (
            lambda: OverTravel(0.1, limits=(MaximumCamRadius(0.02),)),
            ValueRangeError,
            "strain, stress or cable",
        ),
        (lambda: NumberRange("spring.pretension", 2e-3, 1e-3), ValueRangeError, "exchange the two"),
    ],
)
def test_bad_choices_and_limits_are_named(make: object, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        make()  # type: ignore[operator]


def test_misspelt_names_of_stock_and_range_are_named() -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean 'spring\.cam\.elements'"):
        design_cam(
            actuator(CONCAVE), target=TARGET, free=[*CONTOUR, Stock("spring.cam.element", (1, 2))], keep=KEEP
        )
    with pytest.raises(UnknownNameError, match=r"did you mean 'spring\.pretension'"):
        design_cam(
            actuator(CONCAVE), target=TARGET, free=CONTOUR, keep=[NumberRange("spring.pretention", 0.0, 1e-3)]
        )
    stock = Stock("spring.rubber.area", (1e-4, 2e-4))
    with pytest.raises(ValueRangeError, match="free and offered from a stock at once"):
        design_cam(actuator(CONCAVE), target=TARGET, free=[*RUBBER, stock], keep=KEEP)


@pytest.mark.slow
def test_over_travel_keeps_the_strain_beyond_the_last_angle() -> None:
    beyond = OverTravel(degrees(8.0), limits=(MaximumStrain(1.0),))
    design = design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=[*KEEP, beyond], settings=QUICK)
    model = flatten(design.actuator)
    state = [degrees(61.0) if v.name == "motor.angle" else 0.0 for v in model.states]
    assert model.evaluate(state)["spring.rubber.strain"] <= 1.0 + 2e-3
    (kept,) = (each for each in design.limits if each.limit == "OverTravel")
    assert model.evaluate(state)["spring.rubber.strain"] == pytest.approx(kept.value, rel=2e-3)


@pytest.mark.slow
def test_what_a_goal_measures_may_be_a_limit() -> None:
    """Mass of rubber by hand: density · N · A · L; the plates weigh next to nothing."""
    mass = LeastMass(rubber_density=1100.0, plate_thickness=1e-5, plate_density=100.0)

    def rubber(design: CamDesign) -> float:
        numbers = design.actuator.quantities()
        return (
            1100.0 * 2.0 * numbers["spring.rubber.area"].number * numbers["spring.rubber.rest_length"].number
        )

    free = design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=KEEP, settings=WHOLE)
    assert rubber(free) > 2.85e-3
    keep = [*KEEP, AtMost(mass, quantity(2.8, "g"))]
    light = design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=keep, settings=WHOLE)
    assert rubber(light) <= 2.8e-3
    assert "AtMost" in light.active_limits
    with pytest.raises(UnitError, match="unit like 'g'"):
        design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=[AtMost(mass, quantity(3.0, "mm"))])


# Quicker: each limit says what it bounds, in test_limits.py
@pytest.mark.slow
def test_a_torque_band_is_a_limit() -> None:
    """The least mean square error peaks at 47 mN·m; a band of 40 mN·m cuts it off, at the nodes."""
    angles = np.linspace(0.0, TARGET.last_angle, 60)
    wide = TorqueBand(
        angles=tuple(angles),
        lower=tuple(TARGET.torque(angles) - 0.04),
        upper=tuple(TARGET.torque(angles) + 0.04),
    )
    keep = [*KEEP, TorqueWithin(wide)]
    design = design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=keep, settings=ONCE)
    assert np.max(np.abs(design.check.errors)) < 0.045
    free = design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=KEEP, settings=ONCE)
    assert np.max(np.abs(free.check.errors)) > 0.0465
    short = TorqueBand(angles=(0.0, 0.3, 0.5), lower=(0.0, 0.0, 0.0), upper=(1.0, 2.0, 3.0))
    with pytest.raises(ValueRangeError, match="ends before the target does"):
        design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=[TorqueWithin(short)])


@pytest.mark.slow
def test_a_target_that_no_contour_can_give_says_so() -> None:
    """A torque that first rises and then stays has a corner that no convex cam follows."""
    corner = TabulatedTorque(angles=(0.0, 0.1, 0.2, 0.5, 0.9), torques=(0.0, 1.6, 3.0, 3.0, 3.0))
    keep = [*KEEP, PretensionRange(0.0, quantity(2.0, "mm"))]
    missed = design_cam(actuator(CONCAVE), target=corner, free=RUBBER, keep=keep, settings=WHOLE)
    assert missed.miss is not None
    assert missed.miss.advice


@pytest.mark.parametrize(("value", "upper", "end"), [(4.88412, True, "4.885"), (2.16199, False, "2.161")])
def test_a_give_is_rounded_to_the_side_that_is_enough(value: float, upper: bool, end: str) -> None:
    bound = Bound("Limit", "size", ca.SX(0), 1e-3 if upper else 5e-3, upper, "mm", 1e-3)
    give = Give(bound, abs(1e-3 * value - bound.value))
    assert f"(to {end} mm)" in str(give)


def test_rubber_that_is_a_block_and_no_strip_is_said() -> None:
    """30 mm by 30 mm and 6 mm long: S = 900/(120·6) = 1.25, and 1 + 2·S² = 4.1."""
    settings = replace(QUICK, look_for_remedies=False, starts=1)
    sizes = {"spring.rubber.area": quantity(9.0, "cm^2"), "spring.rubber.rest_length": quantity(6.0, "mm")}
    for changed, said in ((sizes, ["4.1 times as stiff"]), ({}, [])):
        machine = actuator(CONCAVE).with_values(changed)
        design = design_cam(machine, target=TARGET, free=CONTOUR, keep=KEEP, settings=settings)
        found = [re.search(r"4\.1 times as stiff|$", each)[0] for each in design.remarks if "block" in each]
        assert found == said


# Ten seconds; defaults that hold are tried in every run.
@pytest.mark.slow
def test_a_broken_default_and_the_end_of_a_range_are_said() -> None:
    """Limits that the designer has replaced by wider ones are not forgotten."""
    published = declare(load_deck("austin2015_as_printed"))
    keep = [MaximumCableTension(5000.0), MaximumStress(quantity(50.0, "MPa"))]
    design = design_cam(published, target=TARGET, free=PRETENSION, keep=keep, settings=WHOLE)
    assert any("MaximumStress" in remark and "allow" in remark for remark in design.remarks)
    heavy = PowerTorque(coefficient=500.0, exponent=1.5, angle=degrees(53.0))
    huge = design_cam(published, target=heavy, free=RUBBER, keep=[MaximumCamRadius(20e-3)], settings=WHOLE)
    assert any("end of its range" in remark for remark in huge.remarks)


def test_a_cam_that_sets_in_too_slowly_is_the_one_to_blame() -> None:
    """The contour does; with a wide onset the made cam does not, and no size helps that."""
    cam = OneSidedCam(lever_arm=(0.01,) * 12, last_angle=degrees(90.0), onset=degrees(15.0))
    machine = actuator(CONCAVE)
    spring = tie(through(cam, rubber=machine["spring.rubber"]), "motor", "load")
    target = PowerTorque(coefficient=0.7, exponent=1.0, angle=degrees(60.0))
    free = ["spring.cam.contour"]
    missed = design_cam(machine.with_part("spring", spring), target=target, free=free, settings=QUICK)
    assert missed.miss is not None
    assert missed.predicted_rms < 1e-3 * target.largest
    assert "make spring.cam.onset smaller" in missed.miss.advice[0]


def test_a_large_deviation_is_written_without_a_power_of_ten() -> None:
    def words(torque: float) -> str:
        return str(Miss(0.3, 0.01, 0.9, torque, (), None, ()))

    assert "-2.471 N·m" in words(-2.471)
    assert "-323 mN·m" in words(-0.3231)
    assert "+1 N·m" in words(0.99996)
    assert "+999 mN·m" in words(0.999)
    assert "e+" not in words(-1e5)
