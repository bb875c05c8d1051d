"""What an FMU says of its variables: on what they depend, how far they can go, how large they usually are."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import casadi as ca
import fmpy
import numpy as np
import pytest
from lxml import etree

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export.c.guarded_step import GuardedModel
from nlsdesign.export.fmi.fmu import fmu_texts
from nlsdesign.export.fmi.fmu_documentation import Authorship
from nlsdesign.export.fmi.fmu_variables import layout
from nlsdesign.export.fmi.model_description import model_structure
from nlsdesign.feedback.control import REPRODUCED_GAINS, torque_controller
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ExportError, ValueRangeError
from nlsdesign.model import flatten
from nlsdesign.model.flat import FlatModel, Table, Variable
from nlsdesign.model.origin import Origin
from tests.hand_built import controller, observer

SCHEMAS = Path(fmpy.__file__).parent / "schema"
DECKS = (
    "austin2015_as_printed",
    "austin2015_figure_consistent",
    "austin2015_stiff_spring",
    "one_sided_cable_drive",
    "janot2019_positioning_drive",
    "vhb4910_specimen",
)


def plant_of(deck: str) -> FlatModel:
    return flatten(declare(load_deck(deck)))


@pytest.fixture(scope="module")
def actuator() -> FlatModel:
    return plant_of("austin2015_figure_consistent")


# --- dependencies ---------------------------------------------------------------------------------


def of_all_kinds(sample_time: float | None) -> tuple[FlatModel, dict[str, ca.SX]]:
    """Outputs of (x, u, p), each with another kind of dependence."""
    t, x, u, p, w = (ca.SX.sym(name) for name in "txupw")
    outputs = {
        "rounded": ca.floor(x),
        "rounded_and_linear": ca.floor(x / 0.3) + x,
        "sign": ca.sign(x),
        "chosen": ca.if_else(u > 0.2, 1.0, 2.0),
        "chosen_branch": ca.if_else(u > 0.2, x, 2.0 * x),
        "limited": ca.fmin(ca.fmax(x, -0.5), 0.5),
        "linear": 3.0 * x - u / 4.0,
        "scaled": p * x + u,
        "divided": u / (1.0 + p * p),
        "tuned_choice": ca.if_else(p > 0.5, x, 2.0 * x),
        "product": x * u,
        "turned": 1.0 / (2.0 + x * x),
        "looked_up": w if sample_time else ca.sin(u),
        "parameter": p + 1.0,
    }
    equations = ca.Function("e", [t, x, u, p, w if sample_time else ca.SX.sym("w", 0)], [
        0.5 * x, ca.vertcat(*outputs.values()), ca.SX(0, 1), ca.SX(0, 1)])  # fmt: skip
    table = Table("u", -1.0, 1.0, (Variable("column", "1", "Column"),), np.array([[0.0], [1.0], [-1.0]]))
    return FlatModel(
        "kinds", "All kinds", (Variable("x", "1", "State"),), (Variable("u", "1", "Input"),),
        (Variable("p", "1", "Parameter", 0.7, 1.0, 0.0, 1.0),),
        tuple(Variable(name, "1", name) for name in outputs), (), equations, sample_time,
        (table,) if sample_time else (),
    ), outputs  # fmt: skip


def felt(model: FlatModel, name: str, known: str) -> str | None:
    """Return the kind of a dependence by trying: secants of different length, places and parameters."""
    index = [v.name for v in model.outputs].index(name)
    generator = np.random.default_rng(6)

    def value(at: dict[str, float]) -> float:
        w = model.look_up([at["x"]], [at["u"]])
        return float(model.equations(0.0, at["x"], at["u"], at["p"], w)[1][index])

    secants = []
    for p in np.linspace(0.1, 0.9, 5):
        row = []
        for _ in range(15):
            at = dict(zip("xu", generator.uniform(-1, 1, 2).tolist(), strict=True)) | {"p": float(p)}
            step = float(generator.uniform(0.3, 1.0))
            row.append((value(at | {known: at[known] + step}) - value(at)) / step)
        secants.append(row)
    if np.all(np.array(secants) == 0.0):
        return None
    if np.ptp(secants, axis=1).max() > 1e-9:
        return "dependent"
    return "constant" if np.ptp(secants) < 1e-9 else "scaled"


@pytest.mark.parametrize("sample_time", [None, 0.01])
def test_the_kind_of_a_dependence_is_that_felt_by_trying(sample_time):
    model, outputs = of_all_kinds(sample_time)
    variables = layout(model)
    names = {each.reference: each.variable.name for each in variables.everything}
    found = {
        unknown.variable.variable.name: dict(
            zip((names[r] for r in unknown.dependencies), unknown.kinds, strict=True)
        )
        for unknown in model_structure(variables).outputs
    }
    word = "fixed" if sample_time is None else "tunable"
    # While a sampled model runs, its outputs are shown to depend on its inputs.
    for name in outputs:
        for known in "xu" if sample_time is None else "u":
            kind = felt(model, name, known)
            assert found[name].get(known) == (word if kind == "scaled" else kind), (name, known)


def test_a_rounded_reading_depends_on_what_is_read(actuator):
    text = fmu_texts(actuator, version="3.0", step=1e-3)["modelDescription.xml"]
    root = etree.fromstring(text)
    references = {v.get("name"): v.get("valueReference") for v in root.find("ModelVariables")}
    (reading,) = (o for o in root.find("ModelStructure").iter("Output"))
    assert reading.get("valueReference") == references["motor_encoder.reading"]
    assert reading.get("dependencies") == references["motor.angle"]
    assert reading.get("dependenciesKind") == "dependent"


# --- ranges ---------------------------------------------------------------------------------------


def test_the_range_of_an_output_holds_for_every_tuning(actuator):
    model = torque_controller(actuator, gains=REPRODUCED_GAINS)  # reaches every limit below
    (shown,) = (each.variable for each in layout(model).given_out)
    limit = model.variable("motor.current_limit")
    assert (shown.minimum, shown.maximum) == (-limit.maximum, limit.maximum)
    with pytest.raises(ValueRangeError, match="current_limit = 60 A"):  # it can only be lowered
        model.with_values({"motor.current_limit": 60.0})
    for tuned in (1e-3, 5.0, 20.0):
        step = GuardedModel(model.with_values({"motor.current_limit": tuned}))
        currents = [step.step([1e6 * (-1) ** (k // 5), 0.0, 0.0])[0][0] for k in range(20)]
        assert max(map(abs, currents)) == pytest.approx(tuned)
        assert shown.minimum <= min(currents) <= max(currents) <= shown.maximum


def test_a_range_without_tuning_stays_and_one_that_cannot_be_known_is_left_out():
    base = controller()
    narrow = replace(base.outputs[0], minimum=-1.0, maximum=1.0)
    (shown,) = (each.variable for each in layout(replace(base, outputs=(narrow,))).given_out)
    assert (shown.minimum, shown.maximum) == (-math.inf, math.inf)  # p[0]·error + x, with any x
    watching = observer()
    speed = replace(watching.outputs[1], minimum=-9.0, maximum=9.0)  # no parameter in it
    shown = [e.variable for e in layout(replace(watching, outputs=(watching.outputs[0], speed))).given_out]
    assert (shown[1].minimum, shown[1].maximum) == (-9.0, 9.0)


# --- typical sizes --------------------------------------------------------------------------------


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("deck", DECKS)
def test_no_typical_size_is_zero_or_not_a_number(deck, version):
    root = etree.fromstring(fmu_texts(plant_of(deck), version=version, step=1e-3)["modelDescription.xml"])
    rows = root.find("ModelVariables").iter("Float64" if version == "3.0" else "ScalarVariable")
    sizes = {}
    for row in rows:
        real = row if version == "3.0" else row[0]
        if row.get("causality") not in ("parameter", "independent"):
            sizes[row.get("name")] = float(real.get("nominal"))
        elif real.get("nominal") is not None:
            assert float(real.get("nominal")) > 0.0
    assert all(0.0 < size < math.inf for size in sizes.values())
    assert len(set(sizes.values())) > 3


def test_sizes_are_those_of_the_machine(actuator):
    sizes = {each.variable.name: each.variable.nominal for each in layout(actuator).reals}
    values = actuator.values
    assert sizes["motor.angle"] == values["spring.cam.last_angle"]
    assert sizes["motor.current"] == values["motor.current_limit"]
    drive = values["motor.current_limit"] * values["motor.torque_constant"] * values["motor.gear_ratio"]
    assert sizes["motor.drive_torque"] == pytest.approx(drive, rel=0.05)
    end = actuator.evaluate([values["spring.cam.last_angle"], 0.0, 0.0])
    for name in ("spring.torque", "spring.rubber.strain", "spring.rubber.force"):
        assert 0.95 * end[name] <= sizes[name] <= 1.5 * end[name], name
    assert sizes["spring.rubber.relaxing.dashpot.strain"] == pytest.approx(
        end["spring.rubber.strain"], rel=0.05
    )
    # Thrown by spring and motor together from the end of the cam.
    thrown = abs(actuator.evaluate([values["spring.cam.last_angle"], 0.0, 0.0], [-20.0])["der(motor.speed)"])
    speed = math.sqrt(thrown * values["spring.cam.last_angle"])
    assert sizes["motor.speed"] == pytest.approx(speed, rel=0.05)
    assert sizes["der(motor.angle)"] == pytest.approx(sizes["motor.speed"], rel=0.05)


def test_without_a_cam_the_largest_drive_gives_the_motion_and_nothing_is_made_up():
    stiff = plant_of("austin2015_stiff_spring")
    sizes = {each.variable.name: each.variable.nominal for each in layout(stiff).reals}
    values = stiff.values
    drive = values["motor.current_limit"] * values["motor.torque_constant"] * values["motor.gear_ratio"]
    at = stiff.evaluate([sizes["motor.angle"], 0.0])
    assert at["spring.torque"] == pytest.approx(drive, rel=0.05)
    # No drive and no cam: neither motion nor speed is known.
    arm = {each.variable.name: each.variable.nominal for each in layout(plant_of("dfki_pendulum")).reals}
    assert (arm["arm.angle"], arm["arm.speed"]) == (1.0, 1.0)


def test_sizes_see_through_gears_and_leave_stated_ones():
    one_sided = plant_of("one_sided_cable_drive")
    sizes = {each.variable.name: each.variable.nominal for each in layout(one_sided).reals}
    at_end = one_sided.evaluate([sizes[v.name] if v.name == "motor.angle" else 0.0 for v in one_sided.states])
    assert at_end["spring.angle"] == pytest.approx(one_sided.values["spring.cam.last_angle"])
    stated = {each.variable.name: each.variable.nominal for each in layout(observer()).reals}
    assert stated["motor.current"] == 5.0
    assert stated["spring.torque"] > 0.0


# --- authorship -----------------------------------------------------------------------------------

ORIGIN = Origin("bench_one", "ab" * 32)
NOON = datetime(2026, 3, 4, 14, 0, 5, tzinfo=timezone(timedelta(hours=2)))


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_an_fmu_says_who_made_it_when_and_from_which_deck(version):
    model = replace(controller(), origin=ORIGIN)
    about = Authorship("A. Maker", "© 2026 A. Maker", "CC-BY-4.0 <for all>", date=NOON)
    texts = fmu_texts(model, version=version, step=1e-3, authorship=about)
    root = etree.fromstring(texts["modelDescription.xml"])
    assert root.get("author") == "A. Maker"
    assert root.get("copyright") == "© 2026 A. Maker"
    assert root.get("license") == "CC-BY-4.0 <for all>"
    assert root.get("generationDateAndTime") == "2026-03-04T12:00:05Z"
    assert root.get("version") == "abababababab"
    assert root.get("description").endswith("(deck bench_one, SHA-256 abababababab)")
    (deck,) = root.iter("deck")
    assert dict(deck.attrib) == {"name": "bench_one", "sha256": "ab" * 32}
    folder = f"fmi{version[0]}"
    schema = etree.XMLSchema(etree.parse(str(SCHEMAS / folder / f"{folder}ModelDescription.xsd")))
    schema.assertValid(root)
    page = texts["documentation/index.html"].decode()
    for text in ("A. Maker", "bench_one", "ab" * 32, "2026-03-04T12:00:05Z", "CC-BY-4.0 &lt;for all&gt;"):
        assert f"<dd>{text}</dd>" in page


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_token_is_a_hash_of_the_content_without_the_date(version):
    def token(model: FlatModel, about: Authorship) -> str:
        text = fmu_texts(model, version=version, step=1e-3, authorship=about)["modelDescription.xml"]
        root = etree.fromstring(text)
        return root.get("guid") or root.get("instantiationToken")

    one, later = Authorship(date=NOON), Authorship(date=NOON + timedelta(days=9))
    assert token(controller(), one) == token(controller(), later)
    assert token(replace(controller(), origin=ORIGIN), one) != token(controller(), one)
    assert token(controller(), Authorship("A. Maker", date=NOON)) != token(controller(), one)


def test_the_date_is_given_or_that_of_the_environment_or_now(monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert Authorship().dated().stamp == "1970-01-02T00:00:00Z"
    assert Authorship(date=NOON).dated().stamp == "2026-03-04T12:00:05Z"
    for bad in ("noon", "1e30", "9" * 30):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", bad)
        with pytest.raises(ExportError, match="SOURCE_DATE_EPOCH"):
            Authorship().dated()
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    now = Authorship().dated().date
    assert abs((datetime.now(UTC) - now).total_seconds()) < 60.0
    with pytest.raises(ValueRangeError, match="time zone"):
        Authorship(date=datetime(2026, 3, 4))
