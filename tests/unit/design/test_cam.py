"""The joint design: what goes in and comes out, what is refused, and conflicts by name."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from scipy.stats import norm

from nlsdesign.components import Pulley, StrainStiffening, Through
from nlsdesign.design import (
    AnchorDistance,
    CamDesign,
    DesignSettings,
    ExponentialTorque,
    MaximumCableTension,
    MaximumCamRadius,
    MaximumStrain,
    MaximumTorqueError,
    MinimumRadiusOfCurvature,
    PretensionRange,
    TorqueError,
    design_cam,
    equilibrium_torque,
)
from nlsdesign.design.optimisation import program
from nlsdesign.foundation.errors import (
    ArrangementError,
    ConvergenceError,
    InfeasibleError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import flatten
from tests.cam_cases import CONCAVE, CONTOUR, CONVEX, KEEP, PRETENSION, RUBBER, TARGET, actuator

SMALL = DesignSettings(starts=2, draws=100, look_for_size_ranges=False)


@pytest.fixture(scope="module")
def found() -> CamDesign:
    return design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=KEEP, settings=SMALL)


def test_values_put_into_the_actuator_give_the_reported_torque(found: CamDesign) -> None:
    changed = actuator(CONCAVE).with_values(found.values)
    assert changed.parts == found.actuator.parts
    assert found.actuator.name.startswith(f"{changed.name}_designed_")
    angles = np.linspace(0.0, TARGET.last_angle, 2001)
    errors = equilibrium_torque(flatten(changed), "spring", angles) - TARGET.torque(angles)
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(found.rms, rel=1e-3)
    assert np.max(np.abs(errors)) == pytest.approx(found.check.largest, rel=1e-2)


def test_nothing_else_is_touched(found: CamDesign) -> None:
    before, after = actuator(CONCAVE).quantities(), found.actuator.quantities()
    moved = {name for name in before if before[name].value != after[name].value}
    assert moved == {"spring.pretension", "spring.cam.lever_arm", "spring.cam.last_angle"}
    assert after["spring.pretension"].source == "designed for ExponentialTorque, 5 N·m"
    with pytest.raises(FrozenInstanceError):
        found.predicted_rms = 0.0  # type: ignore[misc]


@pytest.mark.slow
def test_same_question_same_answer(found: CamDesign) -> None:
    """Quickly: ``test_miss.py::test_starts_are_reproducible_by_seed``."""
    again = design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=KEEP, settings=SMALL)
    assert again.fingerprint == found.fingerprint
    assert pickle.loads(pickle.dumps(found)).fingerprint == found.fingerprint


def test_print_shows_numbers_limits_and_error(found: CamDesign) -> None:
    text = str(found)
    assert f"{1e3 * found.rms:.3g} mN·m rms" in text
    assert "spring.pretension" in text
    assert "strain of spring.rubber 1 <= 1 (MaximumStrain)  ACTIVE" in text
    assert "cam radius 18.72 mm <= 20 mm (MaximumCamRadius)\n" in text
    assert found.active_limits == ("MinimumRadiusOfCurvature", "MaximumStrain")
    assert found.fingerprint in text


def test_contour_is_that_of_the_declared_cam(found: CamDesign) -> None:
    arms = np.interp(0.5, found.contour.angles, found.contour.lever_arms)
    model = flatten(found.actuator)
    state = [0.5 if v.name == "motor.angle" else 0.0 for v in model.states]
    assert model.evaluate(state)["spring.cam.lever_arm_now"] == pytest.approx(arms, abs=2e-6)
    assert found.fit_error < 2e-6


def test_the_tolerance_over_the_spread_is_in_the_result(found: CamDesign) -> None:
    """One modulus with a factor of 1.15 per deviation: what 95 % of the moduli do to the torque, by hand."""
    assert found.tolerance is not None
    modulus = next(each for each in found.tolerance.causes if "modul" in each.cause.name)
    torque = np.sqrt(np.trapezoid(found.check.torques**2, found.check.angles) / TARGET.last_angle)
    off = np.abs(1.15 ** norm.ppf((np.arange(1000) + 0.5) / 1000) - 1.0)
    assert modulus.alone == pytest.approx(np.quantile(off, 0.95) * torque, rel=0.02)
    assert f"{1e3 * found.tolerance.quantiles[-1].value:.4g} mN·m rms" in str(found)


def test_tolerance_band_is_counted() -> None:
    wide = ExponentialTorque(
        maximum=5.0, angle=TARGET.last_angle, shape=1.0, tolerance=quantity(20.0, "mN*m")
    )
    design = design_cam(actuator(CONCAVE), target=wide, free=PRETENSION, keep=KEEP, settings=SMALL)
    inside = np.mean(np.abs(design.check.errors) <= 0.02)
    assert 0.1 < inside < 0.9
    assert design.within_tolerance == pytest.approx(inside)
    assert "of the angles" in str(design)


def test_progress_is_told_after_each_start() -> None:
    steps: list[int] = []
    design = design_cam(
        actuator(CONCAVE),
        target=TARGET,
        free=CONTOUR,
        keep=KEEP,
        settings=DesignSettings(
            draws=0, look_for_size_ranges=False, look_for_remedies=False, progress=lambda: steps.append(1)
        ),
    )
    assert len(steps) == len(design.starts) == 6


@pytest.mark.slow
def test_a_given_cam_leaves_pretension_and_rubber_to_find() -> None:
    """The cam of a found design stays as it is; its pretension, moved away, is found back."""
    best = design_cam(actuator(CONVEX), target=TARGET, free=PRETENSION, keep=KEEP)
    moved = best.actuator.with_values({"spring.pretension": 2e-3})
    back = design_cam(moved, target=TARGET, free=["spring.pretension"], keep=[], goals=[TorqueError()])
    assert set(back.values) == {"spring.pretension"}
    assert back.values["spring.pretension"].number == pytest.approx(
        best.values["spring.pretension"].number, rel=2e-3
    )
    assert back.rms < 2.0 * best.rms


@pytest.mark.slow
def test_the_anchor_may_be_free_with_the_contour() -> None:
    near, far = AnchorDistance(24e-3, 24e-3), AnchorDistance(24e-3, 60e-3)
    free = [*CONTOUR, "spring.cam.anchor_distance"]
    fixed = design_cam(actuator(CONCAVE), target=TARGET, free=free, keep=[*KEEP, near])
    loose = design_cam(actuator(CONCAVE), target=TARGET, free=free, keep=[*KEEP, far])
    assert fixed.values["spring.cam.anchor_distance"].number == pytest.approx(24e-3, rel=1e-6)
    assert 24e-3 - 1e-9 <= loose.values["spring.cam.anchor_distance"].number <= 60e-3 + 1e-9
    assert loose.rms <= fixed.rms * (1 + 1e-6)


@pytest.mark.slow
def test_a_law_with_knots_is_designed_on_too() -> None:
    """On this one Newton's method goes round in circles; the error is still that of the sharp law."""
    sharp = StrainStiffening(
        modulus=(2.346e6, 1.479e6, 1.887e6, 1.9635e6, 1.1985e6, 2.703e6),
        knots=(0.0, 0.016, 0.0848, 0.212, 0.7232, 0.724),
    )
    design = design_cam(actuator(sharp), target=TARGET, free=PRETENSION, keep=KEEP)
    assert design.rms < 2e-3
    angles = np.linspace(0.0, TARGET.last_angle, 401)
    torques = equilibrium_torque(flatten(design.actuator), "spring", angles)
    assert np.sqrt(np.mean((torques - TARGET.torque(angles)) ** 2)) == pytest.approx(design.rms, rel=0.1)


@pytest.mark.parametrize(
    ("free", "error", "words"),
    [
        (["spring.cam.contuor"], UnknownNameError, "did you mean 'spring.cam.contour'"),
        (["spring.rubber.rest_lenght"], UnknownNameError, "did you mean 'spring.rubber.rest_length'"),
        (["motor.inertia"], ValueRangeError, "exists, but a design cannot change it.*spring.cam.contour"),
        (["motor"], UnknownNameError, "no such name"),
        (["spring.cam.elements"], ValueRangeError, "is a whole number"),
        ([], ValueRangeError, "free for instance 'spring.cam.contour'"),
        (["spring.cam.anchor_distance"], ValueRangeError, "free 'spring.cam.contour' too"),
    ],
)
def test_what_cannot_be_free_is_named(free: list[str], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        design_cam(actuator(CONCAVE), target=TARGET, free=free, keep=KEEP)


def test_a_pulley_has_no_contour_to_design() -> None:
    machine = actuator(CONCAVE)
    spring = machine.element("spring")
    assert isinstance(spring, Through)
    round_one = machine.with_part("spring", Through(cam=Pulley(radius=0.01), behind=spring.behind))
    with pytest.raises((ArrangementError, UnknownNameError), match=r"TwoSidedCam|no contour"):
        design_cam(round_one, target=TARGET, free=CONTOUR, keep=[])


def test_a_given_contour_that_ends_too_early_is_named() -> None:
    machine = actuator(CONCAVE).with_values({"spring.cam.last_angle": 0.5})
    with pytest.raises(ValueRangeError, match=r"the contour ends before the wanted 0\.92"):
        design_cam(machine, target=TARGET, free=["spring.pretension"], keep=KEEP)


def gives(message: str) -> dict[str, float]:
    """What a limit bounds, and the number in its own unit by which it alone would have to give."""
    found = {}
    for part in message.partition("one of these is enough: ")[2].split("; "):
        if " would have to give by " in part:
            name = part.removeprefix("or ").partition(" <=")[0].partition(" >=")[0]
            found[name] = float(part.partition(" give by ")[2].split()[0].rstrip(")"))
    return found


@pytest.mark.slow
def test_conflict_of_strain_and_pretension_is_named_with_what_each_would_have_to_give() -> None:
    """3 mm of pretension on 12.5 mm are a strain of 0.24 before the cam has turned."""
    keep = [MinimumRadiusOfCurvature(1e-3), MaximumStrain(0.05), PretensionRange(3e-3, 5e-3)]
    with pytest.raises(InfeasibleError) as caught:
        design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=keep)
    message = str(caught.value)
    amounts = gives(message)
    assert set(amounts) == {"strain of spring.rubber", "spring.pretension"}
    strain = amounts["strain of spring.rubber"]
    # Whatever the contour, the cam adds the extension of the smallest one: both ways round it is the same.
    least = (strain + 0.05) * 12.5 - 3.0
    assert least > 0.0
    assert 3.0 - amounts["spring.pretension"] == pytest.approx(0.05 * 12.5 - least, abs=2e-3)
    # And with a little more than that there is a cam.
    wider = [keep[0], MaximumStrain(0.05 + 1.01 * strain), keep[2]]
    assert design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=wider).rms > 1.0


# Ten seconds; other conflicts are named in every run.
@pytest.mark.slow
def test_conflict_with_the_target_is_named_too() -> None:
    """A lever arm within a cam of 20 mm and 5 N·m need a force of at least 5/(2·0.02) = 125 N."""
    keep = [*KEEP, MaximumCableTension(50.0), MaximumTorqueError(0.01)]
    with pytest.raises(InfeasibleError, match="MaximumTorqueError") as caught:
        design_cam(actuator(CONCAVE), target=TARGET, free=RUBBER, keep=keep)
    amounts = gives(str(caught.value))
    assert 74.0 < amounts["cable tension"] < 80.0
    assert "cam radius" not in amounts
    assert "cam radius" in str(caught.value).partition(" -> ")[2]


@pytest.mark.slow
def test_limits_of_the_geometry_alone_can_be_in_conflict() -> None:
    """An arc of 53° with a radius of 30 mm reaches further than 10 mm."""
    keep = [MinimumRadiusOfCurvature(30e-3), MaximumCamRadius(10e-3)]
    with pytest.raises(InfeasibleError, match=r"limits of radius of curvature .*, cam radius .*: contra"):
        design_cam(actuator(CONCAVE), target=TARGET, free=CONTOUR, keep=keep)


def test_a_solver_that_stops_early_gives_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(program._OPTIONS, "ipopt.max_iter", 2)
    with pytest.raises(ConvergenceError, match="IPOPT"):
        design_cam(actuator(CONCAVE), target=TARGET, free=PRETENSION, keep=KEEP, settings=SMALL)
