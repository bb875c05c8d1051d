"""Which observer is taken, what its errors over the spread say, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.components import CurrentDrivenMotor, Gear, Inertia, TorqueRipple, tie
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import natively
from nlsdesign.feedback.observer import (
    CorrectedDesign,
    Duty,
    ObserverDesign,
    PaperForm,
    SpreadErrors,
    choose_observer,
    design_corrected_observer,
    design_observer,
    design_observer_with_details,
    observer_bench,
    observer_errors,
)
from nlsdesign.feedback.observer.spread.estimator_bound import SensedTorque, estimator_bound
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ArrangementError, ConvergenceError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import quantity, three_digits
from nlsdesign.foundation.spread import EXACT
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation.prior import declared_prior
from tests.renamed import nested, renamed

DUTY = Duty(torque=1.2, frequencies=(4.0,))


@pytest.fixture(scope="module")
def linear() -> FlatModel:
    return flatten(declare(load_deck("austin2015_soft_spring")))


@pytest.fixture(scope="module")
def corrected(linear: FlatModel) -> CorrectedDesign:
    return design_corrected_observer(linear, duty=DUTY)


@pytest.fixture(scope="module")
def errors(linear: FlatModel, corrected: CorrectedDesign) -> SpreadErrors:
    cascade = design_observer_with_details(linear)
    return observer_errors(
        {"corrected": corrected.model, "cascade": cascade.model}, observer_bench(linear, duty=DUTY), draws=12,
        bounded=2, translate=natively,
    )  # fmt: skip


def test_the_corrected_one_is_taken_where_it_expects_less(linear: FlatModel) -> None:
    found = choose_observer(linear)
    assert isinstance(found.design, CorrectedDesign)
    alone, learned = found.expected
    assert learned < alone
    assert found.model.description.endswith(found.reason)
    assert design_observer(linear).outputs == found.model.outputs


def test_without_spreads_the_cascade_is_taken_and_the_reason_is_said(linear: FlatModel) -> None:
    exact = replace(linear, parameters=tuple(replace(v, spread=EXACT) for v in linear.parameters))
    found = choose_observer(exact)
    assert isinstance(found.design, ObserverDesign)
    assert "no uncertain numbers" in found.reason


def test_without_an_encoder_the_cascade_is_taken(linear: FlatModel) -> None:
    parts = dict(declare(load_deck("austin2015_soft_spring")).parts)
    machine = declare(load_deck("austin2015_soft_spring"))
    blind = replace(machine, parts=tuple((n, p) for n, p in parts.items() if n != "motor_encoder"))
    found = choose_observer(flatten(blind))
    assert "no encoder" in found.reason


@pytest.mark.slow
def test_a_machine_with_other_names_gets_the_same_observer(corrected: CorrectedDesign) -> None:
    other = renamed(declare(load_deck("austin2015_soft_spring")), nested)
    found = design_corrected_observer(flatten(other.assembly), duty=DUTY)
    np.testing.assert_allclose(found.balance.deviations, corrected.balance.deviations, rtol=1e-12)
    np.testing.assert_allclose(found.model.tables[0].values, corrected.model.tables[0].values, rtol=1e-9)


def test_outputs_carry_the_expected_deviation_and_factors(corrected: CorrectedDesign) -> None:
    names = [v.name for v in corrected.model.outputs]
    assert names[:2] == ["spring.torque", "correction.standard_deviation"]
    assert sum(n.startswith("correction.factor[") for n in names) == len(corrected.balance.terms)


def test_errors_over_the_spread_are_those_of_their_runs(errors: SpreadErrors) -> None:
    assert errors.exact.shape == (2, 1)
    assert errors.drawn.shape == (2, 12 - errors.lost, 1)
    # With the numbers of the deck the cascade errs by its counts alone: 1.7 N·m/rad times 0.767 mrad/√12.
    count = 1.7 * 0.767e-3 / np.sqrt(12.0)
    assert errors.exact[1, 0] == pytest.approx(count, rel=0.25)
    by_name = dict(errors.ranked_causes("cascade"))
    # A sine of 1.2 N·m with a stiffness that is off by a factor of 1.05, either sign.
    assert by_name["spring.stiffness"] == pytest.approx(np.log(1.05) * 1.2 / np.sqrt(2.0), rel=0.05)
    assert by_name["motor.torque_constant"] < 0.02 * by_name["spring.stiffness"]
    assert errors.ranked_causes("cascade")[0][0] == "spring.stiffness"
    assert float(errors.quantile("cascade", 0.5)[0]) <= float(errors.quantile("cascade", 0.9)[0])
    with pytest.raises(UnknownNameError):
        errors.quantile("cascad", 0.5)
    head, row = (line.split("  ") for line in str(errors).splitlines()[1:3])
    shown = dict(zip(head, row, strict=True))
    assert shown["exact numbers"] == three_digits(1e3 * errors.exact[0, 0])
    assert shown["90 %"] == three_digits(1e3 * errors.quantile("corrected", 0.9)[0])
    assert shown["no estimator below"] == three_digits(1e3 * errors.bound[0])


def test_the_bound_lies_below_what_the_deck_alone_says(errors: SpreadErrors) -> None:
    alone = np.log(1.05) * 1.2 / np.sqrt(2.0)
    assert 0.3 * alone < errors.bound[0] < alone


def test_where_the_motion_is_unstable_there_is_no_bound(linear: FlatModel) -> None:
    """A spring that pushes away: slopes grow by e every 2 ms, and their squares leave what a double holds."""
    turned = {"spring.stiffness": {"minimum": -10.0, "start": -1.7}}
    unstable = replace(
        linear, parameters=tuple(replace(v, **turned.get(v.name, {})) for v in linear.parameters)
    )
    sensed = SensedTorque("spring.torque", "motor.angle", 0.767e-3)
    known = declared_prior(linear).only(["spring.stiffness"])
    with pytest.raises(ConvergenceError, match="not decided by its inputs"):
        estimator_bound(unstable, known, np.ones((1, 2000)), sensed)


def test_the_bound_counts_every_input_of_a_machine() -> None:
    """A rotor behind a gear and the inertia that it turns: current and torque are inputs."""
    machine = declare(load_deck("austin2015_soft_spring"))
    parts = dict(machine.parts)
    rotor = CurrentDrivenMotor(
        inertia=quantity(140.0, "g*cm^2", spread=0.1),
        torque_constant=parts["motor"].torque_constant,
        resistance=quantity(0.3, "Ohm"), current_limit=quantity(20.0, "A"), voltage_limit=quantity(24.0, "V"),
    )  # fmt: skip
    parts["motor"] = Inertia(inertia=quantity(100.0, "g*cm^2", spread=0.1))
    parts["motor_encoder"] = replace(parts["motor_encoder"], of="rotor.angle")
    gear = Gear(between=("rotor", "motor"), ratio=quantity(4.0, "1"))
    two = flatten(replace(machine, parts=(("rotor", rotor), *parts.items(), ("gear", gear))))
    assert [v.name for v in two.inputs] == ["rotor.current", "motor.torque"]
    observers = {"cascade": design_observer_with_details(two).model}
    duty = Duty(torque=0.5, frequencies=(4.0,))
    found = observer_errors(observers, observer_bench(two, duty=duty), draws=4, bounded=1)
    alone = np.log(1.05) * 0.5 / np.sqrt(2.0)
    assert 0.3 * alone < found.bound[0] < alone


def test_bad_settings_are_named(linear: FlatModel) -> None:
    with pytest.raises(ValueRangeError, match="sample_time"):
        design_corrected_observer(linear, sample_time=0.0)
    with pytest.raises(ValueRangeError, match="torque -1"):
        Duty(torque=-1.0)
    with pytest.raises(ValueRangeError, match="the spring has at most"):
        design_corrected_observer(linear, duty=Duty(torque=100.0))
    parts = declare(load_deck("austin2015_soft_spring"))
    ripple = TorqueRipple(sine=quantity(0.2, "N*m"), cosine=quantity(0.1, "N*m"), order=quantity(7.0, "1"))
    rippled = replace(parts, parts=(*parts.parts, ("cogging", tie(ripple, "motor"))))
    with pytest.raises(ArrangementError, match="or a ripple over the angle"):
        design_corrected_observer(flatten(rippled))
    with pytest.raises(ArrangementError, match="one angle"):
        design_observer(flatten(declare(load_deck("one_sided_cable_drive"))))


@pytest.mark.slow
def test_the_figures_of_the_published_actuator() -> None:
    """2.8 N·m, 2 and 5 Hz: exact, rubber with a calibrated drive, and everything over its spread."""
    model = flatten(declare(load_deck("austin2015_figure_consistent")))
    known = declared_prior(model)
    drive = [n for n in known.names if n.startswith(("motor.", "bearing.", "dry_friction."))]
    places = [known.place(n) for n in drive]
    sure = known.covariance.copy()
    sure[places, places] = np.log(1.01) ** 2
    calibrated = replace(known, covariance=sure)
    duty = Duty(torque=2.8)
    trial = observer_bench(model, duty=duty)
    published = design_observer_with_details(model, form=PaperForm()).model
    for prior in (calibrated, known):
        corrected = design_corrected_observer(model, prior=prior, duty=duty)
        found = observer_errors(
            {"corrected": corrected.model, "published": published}, trial,
            prior=prior, draws=48, bounded=4, translate=natively,
        )  # fmt: skip
        print(found)
        assert np.all(found.exact[0] <= 3e-3)
        if prior is calibrated:
            assert np.all(found.quantile("corrected", 0.5) <= 30e-3)
            assert np.all(found.quantile("corrected", 0.9) <= 60e-3)
            assert np.all(4.0 * found.quantile("corrected", 0.5) <= found.quantile("published", 0.5))
        else:
            assert np.all(found.rms("corrected") <= 1.1 * found.bound)
