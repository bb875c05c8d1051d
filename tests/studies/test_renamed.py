"""A machine whose every part has another name gives the same numbers through every command."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import ALL, diagnose, predict, refit, write_refit, write_verdict
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import declare, write_deck
from nlsdesign.design import design_cam
from nlsdesign.feedback.control import ClosedLoop, torque_controller, tracking
from nlsdesign.feedback.observer import CascadeGain, FixedGrid, design_observer
from nlsdesign.feedback.observer.scheduling.scheduled import check_stability
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import FlatModel, flatten
from nlsdesign.presentation.report import verdict_sections, write_report
from nlsdesign.simulation import Sine, simulate
from tests.cam_cases import KEEP, TARGET
from tests.command_line import Run, run
from tests.diagnosed import rig_set
from tests.hand_machines import Level, Machine, made
from tests.renamed import SCHEMES, Renamed, Scheme, exchanged, in_words, nested, renamed
from tests.selection import quick_only
from tests.undrawn import undrawn

__all__ = ["run", "undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

DECKS = ("austin2015_figure_consistent", "austin2015_soft_spring", "one_sided_cable_drive")
UNSEEN = ("first", "last", "eigenvalues")
EVERY = pytest.mark.parametrize("scheme", SCHEMES)
ONE = pytest.mark.parametrize("scheme", quick_only([in_words, exchanged], [in_words]))
CATALOGUE = tuple(each for each in ALL if each.__name__ == "coulomb_friction")


def published() -> Assembly:
    return declare(load_deck(DECKS[0]))


def equal(one: Mapping[str, object], other: Mapping[str, object], tolerance: float = 1e-12) -> None:
    """The same names in the same order, and the same numbers."""
    assert list(one) == list(other)
    for name, value in one.items():
        np.testing.assert_allclose(
            np.asarray(other[name], float),
            np.asarray(value, float),
            rtol=tolerance,
            atol=1e-300,
            err_msg=name,
        )


def names(model: FlatModel) -> list[list[str]]:
    groups = (model.states, model.inputs, model.parameters, model.outputs, model.signals)
    return [[v.name for v in group] for group in groups]


@pytest.mark.long_cases("exchanged", "nested", "against_the_order")
@EVERY
def test_deck_check_and_show(run: Run, tmp_path: Path, scheme: Scheme) -> None:
    machine = renamed(published(), scheme)
    write_deck(machine.assembly, tmp_path / "other.toml")
    assert run("deck", "check", str(tmp_path / "other.toml"))[0] == 0
    shown = [
        json.loads(run("deck", "show", deck, "--json")[1])
        for deck in (DECKS[0], str(tmp_path / "other.toml"))
    ]
    values = [{name: row["value"] for name, row in rows.items()} for rows in shown]
    equal(machine.keys(values[0]), values[1])


@EVERY
@pytest.mark.parametrize("deck", DECKS)
def test_flat_model_and_simulation(scheme: Scheme, deck: str) -> None:
    original = declare(load_deck(deck))
    machine = renamed(original, scheme)
    one, other = flatten(original), flatten(machine.assembly)
    assert [[machine.name(name) for name in group] for group in names(one)] == names(other)
    time = np.linspace(0.0, 0.05, 26)
    traces = [
        simulate(model, time, inputs={model.bodies[0].drives[0]: Sine(2.0, 20.0)}).signals
        for model in (one, other)
    ]
    equal(machine.keys(traces[0]), traces[1])


@pytest.mark.slow
@pytest.mark.long_cases("exchanged", "nested", "against_the_order")
@EVERY
def test_analyse(run: Run, tmp_path: Path, scheme: Scheme) -> None:
    write_deck(renamed(published(), scheme).assembly, tmp_path / "other.toml")
    charts, ranked = [], []
    for deck in (DECKS[0], str(tmp_path / "other.toml")):
        status, out, err = run("analyse", "--deck", deck, "--count", "2", "--out", "o", "--json")
        assert status == 0, err
        chart = json.loads(out)
        unseen = {f"unseen.{key}": [each[key] for each in chart["unseen"]] for key in UNSEEN}
        sensors = [list(row.values())[1:] for row in chart["sensors"]["rows"]]
        assert chart["detectable"]
        charts.append({k: v for k, v in chart.items() if k == "angle" or "." in k} | unseen)
        ranked.append(sensors)
    equal(*charts, tolerance=1e-9)
    assert ranked[0] == ranked[1]


@pytest.mark.long_cases("exchanged", "nested", "against_the_order")
@EVERY
def test_observer_and_controller(scheme: Scheme) -> None:
    machine = renamed(published(), scheme)
    plants = [flatten(published()), flatten(machine.assembly)]
    grid = FixedGrid(-1.0, 1.0, points=41)
    observers = [design_observer(plant, gain=CascadeGain(), grid=grid) for plant in plants]
    controllers = [torque_controller(plant) for plant in plants]
    for one, other in (observers, controllers):
        assert [[machine.name(name) for name in group] for group in names(one)] == names(other)
    np.testing.assert_array_equal(*(observer.tables[0].values for observer in observers))
    assert len({str(check_stability(observer)) for observer in observers}) == 1
    followed = []
    for plant, observer, controller in zip(plants, observers, controllers, strict=True):
        loop = ClosedLoop(plant=plant, observer=observer, controller=controller)
        followed.append(tracking(loop, loop.run(0.05, inputs={loop.desired: 0.3})))
    assert followed[0].rms_error == pytest.approx(followed[1].rms_error, rel=1e-12)
    assert followed[0].estimate_error == pytest.approx(followed[1].estimate_error, rel=1e-12)


def numbers_in(text: str) -> list[str]:
    return re.findall(r"(?<![\w.])-?\d+\.?\d*(?:e[-+]?\d+)?f?(?![\w.])", text)


@pytest.mark.slow
@ONE
def test_export_c(run: Run, tmp_path: Path, scheme: Scheme) -> None:
    machine = renamed(published(), scheme)
    write_deck(machine.assembly, tmp_path / "other.toml")
    sources = []
    # The default observer under one scheme is enough: its design takes several seconds.
    kind = () if scheme is exchanged else ("--kind", "cascade")
    for number, deck in enumerate((DECKS[0], str(tmp_path / "other.toml"))):
        status, _, err = run("export", "c", "--deck", deck, "--out", f"c{number}", *kind)
        assert status == 0, err
        sources.append((tmp_path / f"c{number}" / "observer.c").read_text(encoding="utf-8"))
        header = (tmp_path / f"c{number}" / "observer.h").read_text(encoding="utf-8")
        for name in ("motor", "spring"):
            assert re.search(rf"\b{machine.name(name) if number else name}\b", header), name
    assert len(numbers_in(sources[0])) > 500
    assert numbers_in(sources[0]) == numbers_in(sources[1])


@pytest.mark.slow
def test_export_fmu_and_cosimulate(run: Run, tmp_path: Path) -> None:
    machine = renamed(published(), exchanged)
    write_deck(machine.assembly, tmp_path / "other.toml")
    translations: tuple[Callable[[str], str], ...] = (str, machine.name)
    sizes = []
    for number, deck in enumerate((DECKS[0], str(tmp_path / "other.toml"))):
        # The cascade knows the torque from the first sample; one that learns would still be learning.
        status, _, err = run("export", "fmu", "--deck", deck, "--kind", "cascade", "--out", f"f{number}")
        assert status == 0, err
        name = translations[number]
        called = ["cosimulate", "--stop", "0.1 s", "--step", "1 ms", "--out", f"y{number}.csv", "--json"]
        for instance in ("observer", "plant"):
            called += ["--fmu", f"{instance}={tmp_path / f'f{number}' / instance}.fmu", "--order", instance]
            called += ["--input", f"{instance}.{name('motor.current')}=2@10"]
        wire = f"observer.{name('motor.angle')}=plant.{name('motor_encoder.reading')}"
        status, out, err = run(*called, "--wire", wire)
        assert status == 0, err
        sizes.append({n: v["rms"] for n, v in json.loads(out)["signals"].items()})
    assert sizes[0]["observer.spring.torque"] == pytest.approx(sizes[0]["plant.spring.torque"], rel=0.05)
    translated = {}
    for signal, size in sizes[0].items():
        instance, _, variable = signal.partition(".")
        rate = re.fullmatch(r"der\((.+)\)", variable)
        new = f"der({machine.name(rate[1])})" if rate else machine.name(variable)
        translated[f"{instance}.{new}"] = size
    equal(translated, sizes[1])


@pytest.mark.slow
def test_design(run: Run, tmp_path: Path) -> None:
    machine = renamed(published(), nested)
    write_deck(machine.assembly, tmp_path / "other.toml")
    one = design_cam(published(), target=TARGET, keep=KEEP)
    called = ("design", "--deck", str(tmp_path / "other.toml"), "--maximum", "5 N*m", "--angle", "53 deg")
    contour = machine.name("spring.cam.contour")
    limits = [
        word
        for line in (
            'MinimumRadiusOfCurvature = {radius = "1 mm"}', 'MaximumCamRadius = {radius = "20 mm"}',
            "MaximumStrain = {strain = 1.0}",
        )
        for word in ("--limit", line)
    ]  # fmt: skip
    status, out, err = run(*called, *limits, "--free", contour, "--out", "o", "--json")
    assert status == (0 if one.met else 1), err
    other = json.loads(out[out.index("{") :])
    assert [machine.name(name) for name in one.values] == list(other["values"])
    assert other["torque_error_rms"] == pytest.approx(one.rms, rel=5e-6)  # six digits are written
    assert tuple(other["active_limits"]) == one.active_limits
    drawn = declare(load_deck(tmp_path / "o" / "model.toml"))
    assert list(drawn.quantities()) == [machine.name(name) for name in published().quantities()]


# --- against records of a small joint and of the independent rig ------------------------------------


class Bench(NamedTuple):
    """A deck and its records, and the same with other names."""

    deck: Assembly
    records: RecordSet
    machine: Renamed
    same: RecordSet

    @property
    def both(self) -> tuple[tuple[Assembly, RecordSet], tuple[Assembly, RecordSet]]:
        return (self.deck, self.records), (self.machine.assembly, self.same)


# The rig has more names, and is fitted and diagnosed ten times as long as the joint.
@pytest.fixture(scope="module", params=["joint", pytest.param("rig", marks=pytest.mark.slow)])
def benches(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Records of a machine with dry friction that its deck does not declare, the deck, and both renamed."""
    folder = tmp_path_factory.mktemp("bench")
    if request.param == "rig":
        deck, records = rig_set(folder, "arm", {"coulomb_friction": 1.0}, 5, only=("sine_15deg_5.0Hz",))
        machine = renamed(deck, exchanged)
        return Bench(deck, records, machine, load_records(folder, flatten(machine.assembly)))
    level: Level = lambda rate, angle, load: 0.12  # noqa: E731
    deck, records = made(Machine(stiffness=60.0, size=0.3, friction=level), folder, records=2)
    machine = renamed(deck, exchanged)
    for file in sorted(folder.glob("*.csv")):
        head, rows = file.read_text(encoding="utf-8").split("\n", 1)
        columns = [name.rpartition("_") for name in head.split(",")]
        other = ",".join(f"{machine.name(name)}_{unit}" for name, _, unit in columns)
        (folder / "renamed").mkdir(exist_ok=True)
        (folder / "renamed" / file.name).write_text(f"{other}\n{rows}", encoding="utf-8")
    return Bench(deck, records, machine, load_records(folder / "renamed", flatten(machine.assembly)))


@pytest.mark.long_cases("joint")
def test_simulate_a_record(benches: Bench) -> None:
    machine = benches.machine
    predicted = [predict(deck, seen, seen.records[0].name).signals for deck, seen in benches.both]
    equal(machine.keys(predicted[0]), predicted[1], tolerance=1e-9)


@pytest.mark.long_cases("joint")
def test_fit(benches: Bench, tmp_path: Path) -> None:
    deck, _, machine, _ = benches
    fits = [refit(*each) for each in benches.both]
    fitted, errors = ([{n.name: getattr(n, field) for n in fit.numbers} for fit in fits]
                      for field in ("fitted", "standard_error"))  # fmt: skip
    equal(machine.keys(fitted[0]), fitted[1], tolerance=1e-6)
    equal(machine.keys(errors[0]), errors[1], tolerance=1e-4)
    for number, fit in enumerate(fits):
        write_refit(fit, tmp_path / f"fit{number}")
    assert declare(load_deck(tmp_path / "fit1" / "model.toml")).quantities().keys() == {
        machine.name(name) for name in deck.quantities()
    }


@pytest.mark.slow
def test_diagnose_and_report(benches: Bench, tmp_path: Path) -> None:
    verdicts = [diagnose(*each, catalogue=CATALOGUE) for each in benches.both]
    assert [[effect.name for effect in verdict.effects] for verdict in verdicts] == [["coulomb_friction"]] * 2
    for number, verdict in enumerate(verdicts):
        write_verdict(verdict, tmp_path / f"verdict{number}")
    report = write_report(tmp_path / "report.html", *verdict_sections(verdicts[1]), title="rig")
    assert report.stat().st_size > 10_000
    one, other = (
        (tmp_path / f"verdict{number}" / "verdict.json").read_text(encoding="utf-8") for number in (0, 1)
    )
    assert numbers_of(json.loads(one)) == pytest.approx(numbers_of(json.loads(other)), rel=1e-6, abs=1e-12)


def numbers_of(content: object) -> list[float]:
    """Return every number of a JSON document in written order."""
    if isinstance(content, dict):
        return [number for value in content.values() for number in numbers_of(value)]
    if isinstance(content, list):
        return [number for value in content for number in numbers_of(value)]
    return [float(content)] if isinstance(content, int | float) and not isinstance(content, bool) else []
