"""Neither the order nor the names of records make a difference: to what is stiff, to a fit, to a verdict."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import ALL, diagnose, write_verdict
from nlsdesign.bench.discrepancy.effects import backlash
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import Record, RecordSet, load_records
from nlsdesign.bench.identification.equation_error.block_response import DrivenBlock
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.least_squares import declared_parameter, fit
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.bench.identification.records.quality import Finding
from nlsdesign.components import Assembly
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace
from tests.diagnosed import declared_rig
from tests.rig import ACTUATORS, make_records, write_declaration, write_records

SIGNALS = {"motor_encoder.reading": "rad", "current_sensor.reading": "A", "force_sensor.reading": "N"}
COLUMNS = tuple(Column(name, name, unit) for name, unit in SIGNALS.items())
GAP = 0.05  # rad, the declared gap below


def record(name: str, amplitude: float, noise: float) -> Record:
    """Half a second of a sine of the angle, with a current and, beyond the gap, a force that go with it."""
    time, draw = np.arange(500) * 0.001, noise * np.random.default_rng(1).standard_normal((3, 500))
    angle = amplitude * (1.0 - np.cos(2.0 * np.pi * 4.0 * time))
    force = 100.0 * np.maximum(angle - GAP, 0.0)
    rows = (angle + 1e-4 * draw[0], 2.0 * angle + 0.02 * draw[1], force + 0.2 * draw[2])
    return Record(name, Trace(time, dict(zip(SIGNALS, rows, strict=True)), SIGNALS, name))


@pytest.fixture(scope="module")
def loose() -> Assembly:
    """The rig with backlash at its spring."""
    (candidate,) = backlash(declare(load_deck("test_rig")))
    return candidate.assembly.with_values({"spring.gap": GAP})


SMALL, LARGE = record("small", 0.1 * GAP, 1e-3), record("large", 10.0 * GAP, 1.0)


@pytest.mark.long_cases("small first", "large first")
@pytest.mark.parametrize("order", [(SMALL, LARGE), (LARGE, SMALL)], ids=["small first", "large first"])
def test_a_block_is_stiff_if_any_record_closes_the_gap(loose: Assembly, order: tuple[Record, ...]) -> None:
    bench = Bench(RecordSet(order, COLUMNS), blocks_of(flatten(loose), tuple(SIGNALS)))
    spring, motor = blocks_of(flatten(loose), tuple(SIGNALS))
    assert spring.name == "spring"
    assert bench.driven(spring, []).stiff
    assert not DrivenBlock(spring, [], records=[SMALL]).stiff, "or the test would show nothing"
    held_out = Bench(RecordSet((SMALL, replace(LARGE, role="held_out")), COLUMNS), [spring, motor])
    assert not held_out.driven(spring, []).stiff, "a held-out record decides nothing"


def test_a_fit_is_the_same_to_the_last_digit_whichever_record_comes_first(loose: Assembly) -> None:
    name, results = "spring.gap", []
    for order in ((SMALL, LARGE), (LARGE, SMALL)):
        spring = blocks_of(flatten(loose), tuple(SIGNALS))[0]
        bench = Bench(RecordSet(order, COLUMNS), [spring])
        free = [v.name for v in spring.model.parameters if v.spread][:3]
        numbers = [declared_parameter(spring.model.variable(n)) for n in free]
        driven = bench.driven(spring, free)
        evidence = bench.evidence(driven, bench.records.records, spring.model.values)
        ended = fit(evidence, numbers, evaluations=2)
        results.append(
            (driven.stiff, driven.instructions, ended.values, ended.cost, ended.covariance.tolist())
        )
    assert name in loose.quantities()
    assert results[0] == results[1]


def test_the_canonical_order_is_that_of_content() -> None:
    renamed = [replace(r, name=n, source=f"{n}.csv") for r, n in ((SMALL, "z"), (LARGE, "a"))]
    original = [replace(r, source=f"{r.name}.csv") for r in (LARGE, SMALL)]
    findings = (Finding("large.csv: column 'x'", "is odd"), Finding("small.csv: column 'x'", "is odd"))
    other = (Finding("a.csv: column 'x'", "is odd"), Finding("z.csv: column 'x'", "is odd"))
    one = RecordSet(tuple(original), COLUMNS, findings).in_canonical_order()
    two = RecordSet(tuple(renamed), COLUMNS, other).in_canonical_order()
    called = {"small": "z", "large": "a"}
    assert [called[r.name] for r in one.records] == [r.name for r in two.records]
    places = [f.place.partition(".")[0] for f in one.findings]
    assert [called[name] for name in places] == [f.place.partition(".")[0] for f in two.findings]


@pytest.mark.slow
def test_permuted_file_names_leave_the_verdict_as_it_is_to_the_byte(tmp_path: Path) -> None:
    """Three records, roles kept: the last becomes the first, and the held-out one the last."""
    arm, names = ACTUATORS["arm"], ("sine_15deg_5.0Hz", "sine_25deg_2.0Hz")
    quick, slow = make_records(arm, {"coulomb_friction": 1.0}, 21, only=names).values()
    tables = [quick, slow[:1200], slow[:900]]
    write_declaration(tmp_path, arm)
    rig = declared_rig(tmp_path / "rig.toml", tmp_path / "cam.csv")
    effects = tuple(e for e in ALL if e.__name__ in ("coulomb_friction", "quadratic_drag"))
    verdicts = []
    for called in (("a", "b", "c"), ("b", "c", "a")):
        folder = tmp_path / "".join(called)
        write_records(folder, dict(zip(called, tables, strict=True)))
        records = load_records(folder, flatten(rig), hold_out=[called[1]])
        assert {r.name for r in records.of("held_out")} == {called[1]}
        file, deck = write_verdict(diagnose(rig, records, catalogue=effects), tmp_path / "out")
        # The names of the records, where a sentence mentions one, are not part of the comparison.
        text = file.read_text(encoding="utf8")
        for name, place in zip(called, "xyz", strict=True):
            text = text.replace(f"'{name}'", f"'{place}'").replace(f'"{name}"', f'"{place}"')
        content = json.loads(text)
        # They stand in the order of their files.
        content["records"].sort(key=lambda each: (each["block"], each["record"]))
        verdicts.append((json.dumps(content), deck.read_bytes()))
    assert json.loads(verdicts[0][0])["verdict"] == "named"
    assert verdicts[0] == verdicts[1]


def test_file_names_do_not_choose_among_orders_of_columns(tmp_path: Path) -> None:
    """One file holds its columns in another order; whichever name it has, the signals come alike."""
    arm = ACTUATORS["arm"]
    (table,) = make_records(arm, {}, 3, only=("sine_15deg_5.0Hz",)).values()
    write_declaration(tmp_path, arm)
    model = flatten(declared_rig(tmp_path / "rig.toml", tmp_path / "cam.csv"))
    orders = []
    for turned in ("a", "b"):
        folder = tmp_path / turned
        write_records(folder, {"a": table, "b": table})
        rows = [line.split(",") for line in (folder / f"{turned}.csv").read_text().splitlines()]
        (folder / f"{turned}.csv").write_text("\n".join(",".join([r[0], *r[:0:-1]]) for r in rows) + "\n")
        orders.append(load_records(folder, model, hold_out=["b"]).signals)
    assert orders[0] == orders[1]
