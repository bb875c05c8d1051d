"""Three and more nonlinear members in series, solved together.

Independent roads: ``scipy.optimize.brentq`` on the common effort, with each member inverted on its own; the
same members nested two by two, which takes another algorithm; finite differences.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from nlsdesign.components import (
    TRANSLATION,
    Driven,
    Element,
    InextensibleCable,
    Slack,
    Spring,
    StrainStiffening,
    series,
    specimen,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.linear import jacobian_function
from nlsdesign.simulation import simulate

from .fed_by_rate import BoucWen, Hardening

KNOTS = np.array([0.0, 0.05, 0.2, 0.7])
CORNERS = np.append(KNOTS, 1e6)


def pulled(**members: Element) -> FlatModel:
    made = assembly("p", grip=Driven(domain=TRANSLATION), net=tie(series(**members), "grip"))
    return flatten(made, outputs=["net.force"])


def common(inverses: list, whole: float, most: float) -> float:
    """The effort at which the shares add up."""
    return brentq(lambda f: sum(z(f) for z in inverses) - whole, -most, most, xtol=1e-300, rtol=1e-14)


@pytest.mark.long_cases("4", "6")
@pytest.mark.parametrize("count", [3, 4, 6])
def test_hardening_springs_share_by_the_common_force(count: int) -> None:
    draw = np.random.default_rng(count)
    for _ in range(3):
        stiffness, hardening = 10 ** draw.uniform(-1, 3, count), 10 ** draw.uniform(-2, 5, count)
        members = {
            f"e{i}": Hardening(stiffness=k, hardening=h)
            for i, (k, h) in enumerate(zip(stiffness, hardening, strict=True))
        }
        model = pulled(**members)
        for whole in (1e-6, 1e-3, 0.1, 1.0, 30.0, -5.0):

            def inverse(f: float, k: float, h: float) -> float:
                bound = 1.01 * abs(f) / k + 1e-30
                return brentq(lambda x: h * x**3 + k * x - f, -bound, bound, xtol=1e-300, rtol=1e-15)

            inverses = [
                lambda f, k=k, h=h: inverse(f, k, h) for k, h in zip(stiffness, hardening, strict=True)
            ]
            most = float(np.max(hardening * abs(whole) ** 3 + stiffness * abs(whole)))
            expected = common(inverses, whole, most)
            assert model.evaluate([], [whole, 0.0])["net.force"] == pytest.approx(expected, rel=1e-11)


@pytest.mark.slow
def test_pieces_of_rubber_with_knots_share_by_the_common_force() -> None:
    """Piecewise linear laws, where Newton's method alone may run to and fro between two pieces."""
    draw = np.random.default_rng(7)
    for _ in range(3):
        lengths, moduli = 10 ** draw.uniform(-2, -1, 4), 10 ** draw.uniform(4, 7, (4, 4))
        laws = [StrainStiffening(modulus=tuple(row), knots=tuple(KNOTS)) for row in moduli]
        members = {
            f"e{i}": specimen(area=1e-4, rest_length=length, law=law)
            for i, (length, law) in enumerate(zip(lengths, laws, strict=True))
        }
        model = pulled(**members)
        forces = [1e-4 * np.clip(CORNERS[:, None] - KNOTS, 0.0, None) @ row for row in moduli]
        for whole in (1e-5, 1e-3, 7e-3, 0.02, 0.05, 0.2):
            inverses = [
                lambda f, at=at, length=length: length * float(np.interp(f, at, CORNERS))
                for at, length in zip(forces, lengths, strict=True)
            ]
            expected = common(inverses, whole, 1e8)
            found = model.evaluate([], [whole, 0.0])
            assert found["net.force"] == pytest.approx(expected, rel=1e-9)
            assert sum(found[f"net.e{i}.extension"] for i in range(4)) == pytest.approx(whole, rel=1e-12)


def test_a_slack_member_takes_what_the_others_do_not_need() -> None:
    """Two loose cables and a spring: no force until both have been used up, then three springs in series."""
    first = Slack(length=0.02, members=(("k", Spring(stiffness=300.0)),))
    second = Slack(length=0.01, members=(("k", Spring(stiffness=700.0)),))
    model = pulled(a=first, b=second, c=Spring(stiffness=200.0))
    flexible = 1 / 300 + 1 / 700 + 1 / 200
    for whole in (0.005, 0.02, 0.0299, 0.0301, 0.05, 0.3):
        expected = max(whole - 0.03, 0.0) / flexible
        assert model.evaluate([], [whole, 0.0])["net.force"] == pytest.approx(expected, abs=1e-7)


def test_the_derivative_is_that_of_the_implicit_function() -> None:
    model = pulled(
        a=Hardening(stiffness=3.0, hardening=40.0),
        b=Spring(stiffness=20.0),
        c=Hardening(stiffness=1.0, hardening=900.0),
        d=Hardening(stiffness=30.0, hardening=4.0),
    )
    for whole in (0.01, 0.3, 2.0):
        slope = float(
            jacobian_function(model)(0.0, [], [whole, 0.0], model.start(model.parameters), [])[3][0, 0]
        )
        step = 1e-5 * whole
        ahead, behind = (model.evaluate([], [whole + s, 0.0])["net.force"] for s in (step, -step))
        assert slope == pytest.approx((ahead - behind) / (2 * step), rel=1e-8)


@pytest.mark.slow
def test_together_as_nested_two_by_two_also_where_rates_are_asked_for() -> None:
    a, c = Hardening(stiffness=30.0, hardening=4e4), Hardening(stiffness=10.0, hardening=9e5)
    b = BoucWen(still=5.0, level=0.3, yields_at=0.004)
    together = pulled(a=a, b=b, c=c)
    made = assembly("p", grip=Driven(domain=TRANSLATION), net=tie(series(a=a, rest=series(b=b, c=c)), "grip"))
    nested = flatten(made, outputs=["net.force"])
    times = np.linspace(0.0, 0.5, 26)
    drive = {"grip.position": 0.05 * np.sin(20 * times), "grip.speed": np.cos(20 * times)}
    one, other = (simulate(m, times, inputs=drive, tolerance=1e-10)["net.force"] for m in (together, nested))
    assert np.max(np.abs(one)) > 0.1
    assert one == pytest.approx(other, abs=1e-7 * np.max(np.abs(one)))


@pytest.mark.slow
def test_the_work_grows_with_the_number_of_members() -> None:
    """Nested roots would multiply by twenty-five with each further member."""
    counts = []
    for count in (3, 6, 12):
        members = {f"e{i}": Hardening(stiffness=1.0 + i, hardening=3.0) for i in range(count)}
        counts.append(pulled(**members).equations.n_instructions())
    assert counts[0] < 5_000
    assert counts[1] < 3 * counts[0]
    assert counts[2] < 3 * counts[1]


def test_a_cable_that_goes_slack_in_a_series_of_three() -> None:
    slack = InextensibleCable(members=(("k", Spring(stiffness=500.0)),))
    model = pulled(a=slack, b=Hardening(stiffness=100.0, hardening=10.0), c=Spring(stiffness=50.0))
    for whole in (0.2, 0.01):
        force = model.evaluate([], [whole, 0.0])["net.force"]

        def extension(f: float) -> float:
            inner = brentq(lambda x: 10.0 * x**3 + 100.0 * x - f, 0.0, 1.0, xtol=1e-300, rtol=1e-14)
            return f / 500.0 + inner + f / 50.0

        assert extension(force) == pytest.approx(whole, rel=1e-9)
