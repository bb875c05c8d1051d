"""Made springs against a taut string around a polygon and a neo-Hookean law, both written out here.

The cam is an arc of a circle, so its lever arm has a closed form; the package sees only the control values of
its spline. Nothing of the package's geometry, law or statistics is used on the other side.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.optimize import OptimizeResult, brentq, minimize_scalar

from nlsdesign.components import (
    AnchoredCam,
    Assembly,
    CapstanFriction,
    Fixed,
    GearedMotor,
    Guide,
    OneSidedCam,
    TwoSidedCam,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.transmission.cam import Cam, control_values
from nlsdesign.design import (
    PowerTorque,
    SpreadRules,
    Trim,
    equilibrium_torque,
    tolerance_analysis,
)
from nlsdesign.design.optimisation.finish import torque_check
from nlsdesign.design.tolerance.causes import draw_deviations, spring_causes
from nlsdesign.design.tolerance.made_spring import MadeSpring, made_spring
from nlsdesign.foundation.quantity import quantity
from nlsdesign.foundation.spread import UniformSpread
from nlsdesign.model import flatten
from tests.cam_cases import NeoHooke
from tests.taut_string import arc_lip, pulled

RADIUS, MIDDLE, ANCHOR, LAST = 8e-3, 5e-3, 25e-3, 0.9
TARGET = PowerTorque(coefficient=3.09, exponent=1.92, angle=LAST)
SEEN = slice(5, None, 8)
"""Angles of 101 at which the polygon is pulled taut."""


@dataclass(frozen=True)
class Numbers:
    """A made spring as this test sees it; ``spread`` of the actuator below."""

    modulus: float = 0.85e6
    area: float = 1e-4
    rest_length: float = 12.5e-3
    pretension: float = 4e-3
    anchor: float = ANCHOR
    elements: float = 2.0
    exponent: float = 0.0

    def torque(self, extensions: np.ndarray, lever_arms: np.ndarray) -> np.ndarray:
        stretch = 1.0 + (self.pretension + extensions) / self.rest_length
        force = self.area * self.modulus * (stretch - stretch**-2)
        return self.elements * lever_arms * force * np.exp(self.exponent)


NOMINAL = Numbers()


def direction_of_contact(angle: float, anchor: float = ANCHOR, offset: float = 0.0) -> float:
    """Angle by which the normal of the cable has turned on the arc: its tangent goes through the anchor."""
    return float(brentq(lambda phi: phi - np.arcsin(support(phi, offset) / anchor) - angle, -0.5, 2.2))


def support(phi: float, offset: float = 0.0) -> float:
    """Distance of a tangent of the arc from the centre of the cam."""
    return RADIUS - RADIUS * np.cos(phi) + MIDDLE * np.sin(phi) + offset


def pulled_arc(angles: np.ndarray, anchor: float, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Extension and lever arm on the arc in closed form, for many draws at once in the tests below."""
    phi = np.array([direction_of_contact(angle, anchor, offset) for angle in angles])
    first = direction_of_contact(0.0, anchor, offset) if offset > 0.0 else float(
        brentq(lambda at: support(at, offset), -0.5, 0.5)
    )  # fmt: skip

    def taken(at: np.ndarray) -> np.ndarray:
        whole = (RADIUS + offset) * at - RADIUS * np.sin(at) - MIDDLE * np.cos(at)
        return whole + np.sqrt(anchor**2 - support(at, offset) ** 2)

    touching = phi > first
    arms = np.where(touching, support(phi, offset), 0.0)
    return np.where(touching, taken(phi) - taken(np.array(first)), 0.0), arms


def actuator(cam: Cam | None = None, friction: float | None = None) -> Assembly:
    grid = np.linspace(0.0, 1.15 * LAST, 400)
    arms = np.array([support(direction_of_contact(angle)) for angle in grid])
    law = NeoHooke(modulus=quantity(0.85, "MPa", spread=0.15))
    rubber = specimen(
        area=quantity(1.0, "cm^2", spread=0.05),
        rest_length=quantity(12.5, "mm", spread=0.04),
        stiff=law,
    )
    cam = cam or TwoSidedCam(
        lever_arm=control_values(grid, arms, count=64),
        last_angle=float(grid[-1]),
        changeover=1e-6,
        elements=2.0,
        anchor_distance=quantity(25.0, "mm", spread=0.04),
    )
    behind = rubber if friction is None else CapstanFriction(
        members=(("rubber", rubber),),
        guide=Guide(friction=quantity(friction, "1", spread=0.4), wrap_angle=1.5),
    )  # fmt: skip
    return assembly(
        "bench",
        motor=GearedMotor(inertia=5.97e-4, gear_ratio=4.0, torque_constant=0.055),
        load=Fixed(),
        spring=tie(
            through(cam, element=behind, pretension=quantity(4.0, "mm", spread=0.05)), "motor", "load"
        ),
    )


def made(machine: Assembly, angles: int = 101, rules: SpreadRules | None = None) -> MadeSpring:
    model = flatten(machine)
    causes = spring_causes(model, None, rules or SpreadRules())
    return made_spring(model, None, target=TARGET, causes=causes, angles=angles)


def column(spring: MadeSpring, name: str) -> int:
    return [cause.name for cause in spring.causes].index(name)


def alone(spring: MadeSpring, name: str, size: float) -> np.ndarray:
    deviations = np.zeros((1, len(spring.causes)))
    deviations[0, column(spring, name)] = size
    return spring.torques(deviations)[0]


@pytest.fixture(scope="module")
def bench() -> MadeSpring:
    return made(actuator())


def test_without_deviations_it_is_the_declared_spring(bench: MadeSpring) -> None:
    torques = equilibrium_torque(flatten(actuator()), None, bench.angles)
    assert bench.nominal == pytest.approx(torques, abs=1e-9 * TARGET.largest)
    extensions, arms = pulled(arc_lip(RADIUS, MIDDLE), ANCHOR, bench.angles[SEEN])
    assert bench.nominal[SEEN] == pytest.approx(NOMINAL.torque(extensions, arms), rel=5e-5)


@pytest.mark.parametrize("size", [-2.0, 1.0])
@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("spring.element.moduli", lambda z: replace(NOMINAL, modulus=0.85e6 * (1 + np.log1p(0.15) * z))),
        ("spring.element.area", lambda z: replace(NOMINAL, area=1e-4 * (1 + np.log1p(0.05) * z))),
        (
            "spring.element.rest_length",
            lambda z: replace(NOMINAL, rest_length=12.5e-3 * (1 + np.log1p(0.04) * z)),
        ),
        ("spring.pretension", lambda z: replace(NOMINAL, pretension=4e-3 * (1 + np.log1p(0.05) * z))),
        ("spring.cam.anchor_distance", lambda z: replace(NOMINAL, anchor=ANCHOR * (1 + np.log1p(0.04) * z))),
    ],
)
def test_a_deviating_number_gives_the_torque_of_a_taut_string(
    bench: MadeSpring, name: str, changed: Callable[[float], Numbers], size: float
) -> None:
    spring = changed(size)
    extensions, arms = pulled(arc_lip(RADIUS, MIDDLE), spring.anchor, bench.angles[SEEN])
    expected = spring.torque(extensions, arms)
    found = alone(bench, name, size)[SEEN]
    change = np.max(np.abs(expected - bench.nominal[SEEN]))
    assert change > 0.002 * TARGET.largest
    assert found == pytest.approx(expected, abs=2e-3 * change)


@pytest.mark.parametrize("size", [-2.0, 2.0])
@pytest.mark.parametrize(("part", "order"), [("offset", 0), ("half_wave", 1), ("wave", 2)])
def test_an_error_of_the_edge_gives_the_torque_of_a_taut_string(part: str, order: int, size: float) -> None:
    # An edge that is worse than usual, so that what the polygon cannot resolve is small beside it.
    spring = made(actuator(), rules=SpreadRules(given={"spring.cam.contour": 1e-4}))
    name = f"spring.cam.contour.{part}"
    amplitude = size * spring.causes[column(spring, name)].deviation
    last = direction_of_contact(LAST)
    lip = arc_lip(RADIUS, MIDDLE, lambda phi: amplitude * np.cos(order * np.pi * phi / last))
    extensions, arms = pulled(lip, ANCHOR, spring.angles[SEEN])
    expected = NOMINAL.torque(extensions, arms)
    found = alone(spring, name, size)[SEEN]
    change = np.max(np.abs(expected - spring.nominal[SEEN]))
    assert change > 0.002 * TARGET.largest
    assert found == pytest.approx(expected, abs=5e-3 * change)


def test_a_thicker_cable_is_an_offset_of_the_edge(bench: MadeSpring) -> None:
    cable, edge = column(bench, "spring.cam.cable_radius"), column(bench, "spring.cam.contour.offset")
    same = bench.causes[cable].deviation / bench.causes[edge].deviation
    thicker = alone(bench, "spring.cam.cable_radius", 1.0)
    assert thicker == pytest.approx(alone(bench, "spring.cam.contour.offset", same), rel=1e-12)
    assert np.all(thicker[1:] > bench.nominal[1:])


def test_an_anchored_cam_moves_with_its_anchor_as_its_own_law_says() -> None:
    """The law of this cam holds for any distance of its anchor: another derivation of the same thing."""
    phi = np.linspace(0.0, 2.0, 300)
    row = control_values(phi, np.array([support(at) for at in phi]), count=64)
    cam = AnchoredCam(support=row, last_direction=2.0, anchor_distance=ANCHOR, elements=2.0, changeover=1e-6)
    machine = actuator(cam)
    spring = made(machine, rules=SpreadRules(given={"spring.cam.anchor_distance": 1e-3}))
    nearer = flatten(machine).with_values({"spring.cam.anchor_distance": ANCHOR - 2e-3})
    expected = equilibrium_torque(nearer, None, spring.angles)
    assert np.max(np.abs(expected - spring.nominal)) > 0.02 * TARGET.largest
    found = alone(spring, "spring.cam.anchor_distance", -2.0)
    assert found == pytest.approx(expected, abs=1e-4 * TARGET.largest)


def test_another_size_of_an_anchored_cam_is_another_support_function() -> None:
    """Its law holds for any contour, so a cam that is 2 % larger is one with other numbers."""
    phi = np.linspace(0.0, 2.0, 300)
    row = control_values(phi, np.array([support(at) for at in phi]), count=64)
    cam = AnchoredCam(support=row, last_direction=2.0, anchor_distance=ANCHOR, elements=2.0, changeover=1e-6)
    spring = made(actuator(cam), rules=SpreadRules(given={"spring.cam.support": 0.01}))
    factor = 1.0 + 2.0 * np.log1p(0.01)  # two standard deviations of a relative spread
    larger = actuator(replace(cam, support=tuple(factor * each for each in row)))
    expected = equilibrium_torque(flatten(larger), None, spring.angles)
    change = np.max(np.abs(expected - spring.nominal))
    assert change > 0.01 * TARGET.largest
    found = alone(spring, "spring.cam.support", 2.0)
    assert found == pytest.approx(expected, abs=1e-3 * change)


def test_a_one_sided_cam_with_a_parallel_cable_moves_by_the_offset_itself() -> None:
    """h = p + a and δ = ∫h: with a parallel cable the contact does not move."""
    cam = OneSidedCam(lever_arm=(0.012,) * 8, last_angle=1.2, onset=1e-6, elements=2.0)
    spring = made(actuator(cam))
    amount = spring.causes[column(spring, "spring.cam.contour.offset")].deviation
    expected = NOMINAL.torque((0.012 + amount) * spring.angles, np.full(101, 0.012 + amount))
    assert alone(spring, "spring.cam.contour.offset", 1.0)[1:] == pytest.approx(expected[1:], rel=1e-5)
    assert "spring.cam.anchor_distance" not in [cause.name for cause in spring.causes]


def test_friction_of_guides_acts_against_both_strokes() -> None:
    spring = made(actuator(friction=0.1))
    extensions, arms = pulled(arc_lip(RADIUS, MIDDLE), ANCHOR, spring.angles[SEEN])
    found = alone(spring, "spring.element.friction", 1.0)
    for stroke, sign in ((found[:101], 1.0), (found[101:], -1.0)):
        rubbing = replace(NOMINAL, exponent=sign * 0.1 * (1.0 + np.log1p(0.4)) * 1.5)
        assert stroke[SEEN] == pytest.approx(rubbing.torque(extensions, arms), rel=5e-5)
    # Half of the strokes each: the mean square of both errors.
    errors = found - np.tile(TARGET.torque(spring.angles), 2)
    mean = np.trapezoid((errors[:101] ** 2 + errors[101:] ** 2) / 2, spring.angles) / LAST
    assert spring.rms(found[None, :])[0] == pytest.approx(np.sqrt(mean), rel=1e-9)


@pytest.mark.parametrize("friction", [None, 0.1])
def test_first_order_is_the_slope_of_the_exact_torque(friction: float | None) -> None:
    spring = made(actuator(friction=friction))
    for k, cause in enumerate(spring.causes):
        steps = np.zeros((2, len(spring.causes)))
        steps[:, k] = [1e-3, -1e-3]
        ahead, behind = spring.torques(steps)
        slope = (ahead - behind) / 2e-3
        # Close to zero angle an offset that leaves the cable free in its channel has no slope.
        used = np.tile(spring.angles > 0.0, 2 if spring.rubs else 1)
        size = np.max(np.abs(slope))
        assert spring.sensitivities[k][used] == pytest.approx(slope[used], abs=1e-3 * size), cause.name


RULES = SpreadRules(given={"spring.cam.contour": 0.0, "spring.cam.cable_radius": 1e-4})
"""Of the edge only an offset, whose contact has a closed form."""


def own_draws(count: int, seed: int) -> list[tuple[Numbers, float]]:
    generator = np.random.default_rng(seed)
    result = []
    for _ in range(count):
        z = generator.normal(size=6)
        numbers = Numbers(
            modulus=0.85e6 * (1 + np.log1p(0.15) * z[0]), area=1e-4 * (1 + np.log1p(0.05) * z[1]),
            rest_length=12.5e-3 * (1 + np.log1p(0.04) * z[2]), pretension=4e-3 * (1 + np.log1p(0.05) * z[3]),
            anchor=ANCHOR * (1 + np.log1p(0.04) * z[4]),
        )  # fmt: skip
        result.append((numbers, 1e-4 * z[5]))
    return result


def own_rms(
    pretension: float, numbers: Numbers, touched: tuple[np.ndarray, np.ndarray], angles: np.ndarray
) -> float:
    torque = replace(numbers, pretension=pretension).torque(*touched)
    return float(np.sqrt(np.trapezoid((torque - TARGET.torque(angles)) ** 2, angles) / LAST))


def best_pretension(
    numbers: Numbers, touched: tuple[np.ndarray, np.ndarray], angles: np.ndarray
) -> OptimizeResult:
    return minimize_scalar(
        own_rms, args=(numbers, touched, angles), bounds=(0.0, 0.03), method="bounded",
        options={"xatol": 1e-9},
    )  # fmt: skip


def own_errors(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rms errors as built and with the best pretension, by this test's own Monte Carlo."""
    angles, built, after = np.linspace(1e-9, LAST, 25), [], []
    for numbers, offset in own_draws(count, seed=20):
        touched = pulled_arc(angles, numbers.anchor, offset)
        built.append(own_rms(numbers.pretension, numbers, touched, angles))
        after.append(best_pretension(numbers, touched, angles).fun)
    return np.array(built), np.array(after)


@pytest.mark.long_cases("600-2000")
@pytest.mark.parametrize(("count", "draws"), [(80, 300), (600, 2000)])
def test_quantiles_agree_with_an_independent_monte_carlo(count: int, draws: int) -> None:
    result = tolerance_analysis(actuator(), target=TARGET, rules=RULES, draws=draws, seed=3)
    for own, quantiles in zip(own_errors(count), (result.quantiles, result.trims[0].quantiles), strict=True):
        for each in quantiles:
            # Of the test's own draws as many lie below as the share says, within three standard errors.
            below = np.mean(own <= each.value)
            allowed = 3 * np.sqrt(each.share * (1 - each.share) * (1 / len(own) + 1 / draws))
            assert below == pytest.approx(each.share, abs=allowed)
            assert each.lower < each.value < each.upper


def test_the_trim_is_the_least_error_that_scipy_finds() -> None:
    given = {"spring.cam.contour": 0.0, "spring.cam.cable_radius": 0.0, "spring.cam.anchor_distance": 0.0}
    rules = SpreadRules(given=given)
    result = tolerance_analysis(actuator(), target=TARGET, rules=rules, draws=20, seed=8)
    touched = pulled_arc(result.angles[1:], ANCHOR, 0.0)
    touched = (np.append(0.0, touched[0]), np.append(0.0, touched[1]))
    causes = spring_causes(flatten(actuator()), None, rules)
    columns = draw_deviations(causes, 20, seed=8).T
    z = {cause.name.rpartition(".")[2]: column for cause, column in zip(causes, columns, strict=True)}
    for k in range(20):
        numbers = replace(
            NOMINAL,
            modulus=0.85e6 * (1 + np.log1p(0.15) * z["moduli"][k]),
            area=1e-4 * (1 + np.log1p(0.05) * z["area"][k]),
            rest_length=12.5e-3 * (1 + np.log1p(0.04) * z["rest_length"][k]),
        )
        best = best_pretension(numbers, touched, result.angles)
        assert result.trims[0].errors[k] == pytest.approx(best.fun, rel=1e-4)
        assert result.trims[0].settings[k] == pytest.approx(best.x, abs=2e-6)


def test_a_trim_stops_at_the_end_of_its_range() -> None:
    ends = (3.9e-3, 4.1e-3)
    trims = [Trim("spring.pretension", *ends)]
    result = tolerance_analysis(actuator(), target=TARGET, draws=60, trims=trims)
    settings = result.trims[0].settings
    assert (settings.min(), settings.max()) == pytest.approx(ends)
    free = tolerance_analysis(actuator(), target=TARGET, draws=60)
    assert np.all(free.trims[0].errors <= result.trims[0].errors + 1e-9)


def test_without_any_spread_nothing_deviates() -> None:
    names = ("spring.element.moduli", "spring.element.area", "spring.element.rest_length")
    others = (
        "spring.pretension",
        "spring.cam.anchor_distance",
        "spring.cam.contour",
        "spring.cam.cable_radius",
    )
    rules = SpreadRules(given=dict.fromkeys((*names, *others), 0.0))
    result = tolerance_analysis(actuator(), target=TARGET, rules=rules, draws=20, trims=[])
    check = torque_check(flatten(actuator()), target=TARGET)
    assert (result.causes, result.trims) == ((), ())
    assert np.ptp(result.errors) == 0.0
    assert result.errors[0] == pytest.approx(check.rms, rel=1e-3)  # 101 angles against 801


@pytest.mark.slow
def test_alone_and_measured_and_halved_are_those_of_other_spreads() -> None:
    """What a cause does alone, or less of it, is what an analysis with these spreads gives."""
    result = tolerance_analysis(actuator(), target=TARGET, draws=1000, seed=5)
    effect = next(each for each in result.causes if each.cause.name == "spring.element.moduli")
    # A spread is one of the logarithm. Half of what each draw deviates and a spread of half of it agree
    # to second order: they differ by (s z)²/8 of the deviation.
    second = math.log1p(0.15) ** 2 / 8.0
    halved = SpreadRules(given={"spring.element.moduli": math.sqrt(1.15) - 1.0})
    again = tolerance_analysis(actuator(), target=TARGET, draws=1000, seed=5, rules=halved)
    assert effect.halved == pytest.approx(again.quantiles[-1].value, rel=second)
    assert effect.halved_after_trim == pytest.approx(again.trims[0].quantiles[-1].value, rel=5e-3)
    without = SpreadRules(given={"spring.element.moduli": 0.0})
    gone = tolerance_analysis(actuator(), target=TARGET, draws=1000, seed=5, rules=without)
    assert effect.measured == pytest.approx(gone.quantiles[-1].value, rel=1e-9)
    # Alone: the torque is proportional to the modulus, so the error is a known function of one number.
    angles, nominal = result.angles, result.nominal
    z = np.random.default_rng(1).normal(size=20000)
    errors = nominal * (1 + np.log1p(0.15) * z[:, None]) - TARGET.torque(angles)
    rms = np.sqrt(np.trapezoid(errors**2, angles, axis=1) / LAST)
    assert effect.alone == pytest.approx(np.quantile(rms, 0.95), rel=0.02)


def test_shares_are_those_of_finite_differences_on_the_taut_string() -> None:
    result = tolerance_analysis(actuator(), target=TARGET, rules=RULES, draws=20)
    angles = np.linspace(1e-9, LAST, 101)

    def torque(numbers: Numbers, offset: float = 0.0) -> np.ndarray:
        return numbers.torque(*pulled_arc(angles, numbers.anchor, offset))

    def size(step: Callable[[float], np.ndarray]) -> float:
        slope = (step(1e-2) - step(-1e-2)) / 2e-2
        return float(np.trapezoid(slope**2, angles))

    sizes = {
        "spring.element.moduli": size(
            lambda z: torque(replace(NOMINAL, modulus=0.85e6 * (1 + np.log1p(0.15) * z)))
        ),
        "spring.element.area": size(lambda z: torque(replace(NOMINAL, area=1e-4 * (1 + np.log1p(0.05) * z)))),
        "spring.element.rest_length": size(
            lambda z: torque(replace(NOMINAL, rest_length=12.5e-3 * (1 + np.log1p(0.04) * z)))
        ),
        "spring.pretension": size(
            lambda z: torque(replace(NOMINAL, pretension=4e-3 * (1 + np.log1p(0.05) * z)))
        ),
        "spring.cam.anchor_distance": size(
            lambda z: torque(replace(NOMINAL, anchor=ANCHOR * (1 + np.log1p(0.04) * z)))
        ),
        "spring.cam.cable_radius": size(lambda z: torque(NOMINAL, 1e-4 * z)),
    }
    found = {each.cause.name: each.share for each in result.causes}
    whole = sum(sizes.values())
    assert found == pytest.approx({name: part / whole for name, part in sizes.items()}, rel=2e-3)
    assert sum(found.values()) == pytest.approx(1.0)


def test_a_range_stays_within_its_ends() -> None:
    bounds = SpreadRules(given={"spring.element.moduli": UniformSpread(0.15)})
    spring = made(actuator(), rules=bounds)
    moduli = spring.causes[column(spring, "spring.element.moduli")]
    assert moduli.deviation == pytest.approx(0.15 / np.sqrt(3.0))
    z = draw_deviations([moduli], 20000, seed=0)[:, 0]
    assert 0.99 * np.sqrt(3.0) < np.max(np.abs(z)) <= np.sqrt(3.0)
    assert np.std(z) == pytest.approx(1.0, rel=0.02)
