"""The designed observer as a flat model: names, units, table, start, and clear words on bad input."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Fixed,
    LinearDrive,
    LinearElastic,
    SlidingFillers,
    Spring,
    StrainStiffening,
    ViscousMaterial,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.feedback.observer import (
    CascadeGain,
    FixedGrid,
    GridByTolerance,
    Minimal,
    ObserverDesign,
    PaperForm,
    PolePlacement,
    design_observer,
    design_observer_with_details,
    observe,
)
from nlsdesign.feedback.observer.scheduling.scheduled import check_stability, whole_contour
from nlsdesign.foundation.errors import (
    ArrangementError,
    ConvergenceError,
    MeasurementError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.foundation.quantity import parse_unit
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace, simulate
from tests import observed as ob

GRID = GridByTolerance(-1.2, 1.2)


@pytest.fixture(scope="module")
def model() -> FlatModel:
    return ob.bench(ob.SLOW)


@pytest.fixture(scope="module")
def design(model: FlatModel) -> ObserverDesign:
    return design_observer_with_details(model, grid=GRID)


def test_names_are_those_of_the_plant(design: ObserverDesign) -> None:
    observer = design.model
    assert [v.name for v in observer.inputs] == ["motor.angle", "motor.current"]
    assert [v.name for v in observer.outputs] == [
        "spring.torque",
        ob.STRAIN,
        "motor.angle.estimate",
        "motor.speed",
        "motor.angle.innovation",
    ]
    assert [v.name for v in observer.states] == [
        f"{n}.memory" for n in (ob.STRAIN, "motor.angle", "motor.speed")
    ]
    assert observer.sample_time == 1e-3
    assert observer.parameters == ()


def test_every_name_is_unique_and_every_unit_known(design: ObserverDesign) -> None:
    observer = design.model
    (table,) = observer.tables
    everything = observer.inputs + observer.outputs + observer.states + table.columns
    assert len({v.name for v in everything}) == len(everything)
    for v in everything:
        parse_unit(v.unit)
        assert v.description
    per_strain = table.columns[0]
    assert per_strain.name == f"estimate.spring.torque.per.{ob.STRAIN}"
    assert per_strain.unit == "N*m"


def test_only_what_depends_on_the_angle_is_tabulated(design: ObserverDesign) -> None:
    (table,) = design.model.tables
    assert table.argument == "motor.angle"
    assert table.lower == pytest.approx(-1.2)
    assert table.lower + table.step * (len(table.values) - 1) == pytest.approx(1.2)
    assert len(table.columns) <= 4
    assert np.all(np.ptp(table.values, axis=0) > 0.0)
    assert max(design.table_error.values()) <= GRID.tolerance


def test_reading_the_table_costs_no_more_than_the_stated_error(
    design: ObserverDesign, model: FlatModel
) -> None:
    """The estimate at random angles and inner states against the model itself."""
    draw, full = np.random.default_rng(5), 0.0
    off = []
    for angle in draw.uniform(-1.2, 1.2, 300):
        strain = draw.uniform(0.0, 0.5)
        true = model.evaluate([angle, 0.0, strain])["spring.torque"]
        state = design.start(angle)
        memory = [state[v.name] for v in design.model.states]
        # The memory of the strain is set so that the estimate of the strain is the wanted one.
        before = design.model.evaluate(memory, [angle, 0.0])
        memory[0] += strain - before[ob.STRAIN]
        off.append(abs(design.model.evaluate(memory, [angle, 0.0])["spring.torque"] - true))
        full = max(full, abs(true))
    assert max(off) <= 2.0 * GRID.tolerance * full
    assert max(off) > 1e-6 * full  # it is a table


@pytest.mark.parametrize("angle", [-0.8, 0.0, 0.31])
def test_an_observer_that_starts_at_rest_stays_there(
    model: FlatModel, design: ObserverDesign, angle: float
) -> None:
    at = model.evaluate([angle, 0.0, model.evaluate([angle, 0.0, 0.0])["spring.rubber.strain"]])
    time = np.arange(0.0, 0.2, 1e-3)
    rest = np.ones_like(time)
    record = Trace(
        time,
        {"motor.angle": angle * rest, "motor.current": at["spring.torque"] / ob.CONSTANT * rest},
        {"motor.angle": "rad", "motor.current": "A"},
    )
    found = observe(design.model, record, start=design.start(angle))
    assert np.max(np.abs(found["spring.torque"] - at["spring.torque"])) < 2e-3
    # What is left is the error of the table: far below one count of the encoder, and one count per 38 ms.
    assert np.max(np.abs(found["motor.angle.innovation"])) < 0.05 * ob.COUNT
    assert np.max(np.abs(found["motor.speed"])) < 0.02


def test_beyond_the_table_its_ends_are_held(design: ObserverDesign) -> None:
    memory = [design.start(1.2)[v.name] for v in design.model.states]
    inside, outside = (design.model.evaluate(memory, [angle, 0.0]) for angle in (1.2, 3.0))
    assert outside["spring.torque"] == pytest.approx(inside["spring.torque"], rel=1e-9)


def test_the_published_form_has_the_same_interface(model: FlatModel) -> None:
    observer = design_observer(
        model, form=PaperForm(rate_bandwidth=30.0), grid=FixedGrid(-1.0, 1.0, points=101)
    )
    assert [v.name for v in observer.inputs] == ["motor.angle", "motor.current"]
    assert observer.outputs[0].name == "spring.torque"
    shown = {v.name for v in observer.outputs}
    assert {ob.FORCE, ob.EXTENSION, "motor.speed", f"{ob.EXTENSION}.innovation"} <= shown
    assert [v.name for v in observer.states][-2:] == [f"{ob.EXTENSION}.previous", f"{ob.EXTENSION}.rate"]


def test_the_filter_on_the_rate_forgets_at_its_bandwidth(model: FlatModel) -> None:
    """At the same extension as before the rate decays by e^(−2πfT); of a new rate the rest comes in."""
    observer = design_observer(
        model, form=PaperForm(rate_bandwidth=30.0), grid=FixedGrid(-1.0, 1.0, points=101)
    )
    names = [v.name for v in observer.states]
    rate, previous = names.index(f"{ob.EXTENSION}.rate"), names.index(f"{ob.EXTENSION}.previous")
    angle = 0.4
    keep = np.exp(-2.0 * np.pi * 30.0 * observer.sample_time)

    def following(state: np.ndarray) -> np.ndarray:
        table = observer.look_up(list(state), [angle, 0.0])
        return np.array(observer.equations(0.0, state, [angle, 0.0], [], table)[0]).ravel()

    state = observer.start(observer.states)
    state[previous] = following(state)[previous]
    state[rate] = 0.05
    assert following(state)[rate] == pytest.approx(keep * 0.05)
    state[rate] = 0.0
    state[previous] -= 2e-5
    assert following(state)[rate] == pytest.approx((1.0 - keep) * 2e-5 / observer.sample_time)


def test_a_linear_spring_needs_no_inner_state() -> None:
    parts = dict(ob.actuator().parts) | {
        "spring": tie(Spring(stiffness=1.7, domain=ROTATION), "motor", "load")
    }
    model = flatten(assembly("soft", **parts), outputs=["motor.angle", "spring.torque"])
    design = design_observer_with_details(model)
    assert whole_contour(model).upper == pytest.approx(np.pi / 2.0)
    assert design.model.evaluate([0.0, 0.0], [0.25, 0.0])["spring.torque"] == pytest.approx(
        1.7 * 0.25, rel=1e-6
    )
    assert check_stability(design.model).proved


def test_two_branches_are_carried_and_proved() -> None:
    branches = {
        name: series(spring=LinearElastic(modulus=k), dashpot=ViscousMaterial(viscosity=eta))
        for name, k, eta in (("fast", 0.58e6, 31e3), ("slow", 0.3e6, 411e3))
    }
    stiff = StrainStiffening(modulus=tuple(ob.MODULI), knots=tuple(ob.ENGAGING / ob.LENGTH))
    rubber = specimen(area=ob.AREA, rest_length=ob.LENGTH, stiff=stiff, **branches)
    actuator = ob.actuator()
    cam = actuator["spring.cam"]
    parts = dict(actuator.parts) | {"spring": tie(through(cam, rubber=rubber), "motor", "load")}
    model = flatten(assembly("two", **parts), outputs=["motor.angle", "spring.torque"])
    observer = design_observer(model, gain=CascadeGain(), grid=GRID)
    assert len(observer.states) == 4
    assert check_stability(observer).proved
    record = simulate(
        model, np.arange(0.0, 1.0, 1e-3), inputs={"motor.current": lambda t: 1.5 * np.sin(9.0 * t)}
    )
    error = observe(observer, record)["spring.torque"] - record["spring.torque"]
    assert np.max(np.abs(record["spring.torque"])) > 0.2
    assert np.max(np.abs(error)) < 5e-3


def test_an_observer_survives_pickling(design: ObserverDesign) -> None:
    again = pickle.loads(pickle.dumps(design.model))
    memory = [0.1, 0.2, 0.3]
    assert again.evaluate(memory, [0.4, 0.5]) == design.model.evaluate(memory, [0.4, 0.5])


def test_the_design_prints_what_it_costs(design: ObserverDesign) -> None:
    text = str(design)
    assert "table: " in text
    assert "table error of spring.torque" in text
    assert "proved" in str(check_stability(design.model))


def test_bad_names_are_named(model: FlatModel) -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean 'spring\.torque'"):
        design_observer(model, estimate="spring.torqe")
    with pytest.raises(UnknownNameError, match=r"did you mean 'motor\.angle'"):
        design_observer(model, measured="motor.angel")


def test_bad_numbers_are_named(model: FlatModel, design: ObserverDesign) -> None:
    with pytest.raises(ValueRangeError, match="sample_time"):
        design_observer(model, sample_time=0.0)
    with pytest.raises(ValueRangeError, match="continuous model"):
        design_observer(design.model)
    with pytest.raises(ValueRangeError, match="rate_bandwidth"):
        design_observer(model, form=PaperForm(rate_bandwidth=0.0))
    with pytest.raises(ValueRangeError, match="needs 3 poles"):
        design_observer(model, gain=PolePlacement((-1.0,)), form=Minimal(), grid=FixedGrid())
    with pytest.raises(ConvergenceError, match="allow a larger error or more points"):
        design_observer(
            model, gain=CascadeGain(), grid=GridByTolerance(-1.0, 1.0, tolerance=1e-9, most_points=129)
        )


def test_hysteresis_led_by_the_speed_has_no_observer_over_one_angle() -> None:
    stiff = StrainStiffening(modulus=tuple(ob.MODULI), knots=tuple(ob.ENGAGING / ob.LENGTH))
    filled = specimen(
        area=ob.AREA,
        rest_length=ob.LENGTH,
        stiff=stiff,
        fillers=SlidingFillers(modulus=3e5, yield_stress=2e4),
    )
    actuator = ob.actuator()
    parts = dict(actuator.parts) | {
        "spring": tie(through(actuator["spring.cam"], rubber=filled), "motor", "load")
    }
    with pytest.raises(ConvergenceError, match="hysteresis"):
        design_observer(flatten(assembly("filled", **parts)))


def test_a_record_must_fit_the_observer(model: FlatModel, design: ObserverDesign) -> None:
    time = np.arange(0.0, 0.01, 1e-3)
    angle = {"motor.angle": np.zeros(len(time))}
    with pytest.raises(MeasurementError, match=r"motor\.current"):
        observe(design.model, Trace(time, angle, {"motor.angle": "rad"}))
    with pytest.raises(ValueRangeError, match=r"every 0\.001 s"):
        observe(design.model, Trace(2.0 * time, angle, {"motor.angle": "rad"}))
    with pytest.raises(ValueRangeError, match="not a discrete observer"):
        observe(model, Trace(time, angle, {"motor.angle": "rad"}))
    with pytest.raises(ValueRangeError, match="is not an observer"):
        check_stability(model)


def test_an_observer_is_scheduled_over_an_angle_alone() -> None:
    """A position in metres must not be put into a table of angles."""
    slide = assembly(
        "slide",
        table=LinearDrive(mass=2.0, force_constant=20.0, voltage_limit=10.0),
        load=Fixed(domain=TRANSLATION),
        rope=tie(Spring(stiffness=5e3), "table", "load"),
    )
    with pytest.raises(ArrangementError, match=r"'table.position'.*is in m; .*over an angle"):
        design_observer(flatten(slide), estimate="rope.force", measured="table.position")
