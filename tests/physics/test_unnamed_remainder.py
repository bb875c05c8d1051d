"""What has no name is added as a table where that predicts other records, and only there.

The records come from the rig that shares no model code with the package: a cam that rubs at one place, which
no catalogue lists; rubber that stiffens as no table says; a disturbance that depends on time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import ALL, diagnose, predict
from nlsdesign.bench.discrepancy.effects.effect import Candidate
from nlsdesign.bench.discrepancy.effects.unnamed_tables import EFFECT, unnamed_part
from nlsdesign.bench.discrepancy.screening.scale_and_sign import typical_sizes
from nlsdesign.bench.discrepancy.selection.comparison import Comparison
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.components.assembly.deck_writer import declare, write_deck
from nlsdesign.export import natively
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from nlsdesign.simulation import simulate
from tests.diagnosed import declared_rig
from tests.rig import ACTUATORS, make_records, truth, write_set
from tests.rig.bench import SPOT_PLACE

RECORDS = ("sine_45deg_0.5Hz", "sine_25deg_2.0Hz", "sine_15deg_5.0Hz", "multisine")
HELD_OUT = "sine_25deg_2.0Hz"
SEED = 41
CASES = [("arm", "rubbing_spot", "motor"), ("wrist", "strain_stiffening", "spring")]


@dataclass(frozen=True, eq=False)
class Case:
    """Records with something hidden, and the refitted declared model."""

    records: RecordSet
    comparison: Comparison
    base: Hypothesis

    def part(self, block: str) -> Candidate | None:
        fit = next(f for names, f in self.base.fits.items() if block in names)
        return unnamed_part(self.base.assembly, fit, self.comparison.bench, block)

    def excess(self, hypothesis: Hypothesis, block: str, role: str) -> float:
        """Mean square in units of the noise floor, less that of noise."""
        names = {r.name for r in self.records.records if r.role == role}
        own = [t for (b, name), t in hypothesis.tallies.items() if b == block and name in names]
        return sum(t.squares for t in own) / sum(t.rows for t in own) - 1.0


@cache
def case(actuator: str, effect: str, only: tuple[str, ...] = RECORDS) -> Case:
    with TemporaryDirectory() as place:
        folder = Path(place)
        tables = make_records(ACTUATORS[actuator], {effect: 1.0}, SEED, only=only)
        write_set(folder, ACTUATORS[actuator], tables)
        declared = declared_rig(folder / "rig.toml", folder / "cam.csv")
        records = load_records(folder, flatten(declared), hold_out=[HELD_OUT])
    bench = Bench(records, blocks_of(flatten(declared), records.signals))
    comparison = Comparison(bench, typical_sizes(declared, records))
    return Case(records, comparison, comparison.base(declared))


@pytest.mark.slow
@pytest.mark.long_cases("wrist-strain_stiffening-spring")
@pytest.mark.parametrize(("actuator", "effect", "block"), CASES)
def test_the_gap_closes_on_a_record_that_was_held_out(actuator: str, effect: str, block: str) -> None:
    made = case(actuator, effect)
    candidate = made.part(block)
    assert candidate is not None
    after = made.comparison.with_effect(made.base, candidate)
    assert after is not None
    before = made.excess(made.base, block, "held_out")
    assert before > 1.0
    assert made.excess(after, block, "held_out") < 0.2 * before
    assert made.excess(after, block, "fit") < 0.2 * made.excess(made.base, block, "fit")


@pytest.mark.slow
def test_no_record_is_proposed_for_the_values_of_a_table(tmp_path: Path) -> None:
    """Each value of a table stands for no part that anybody could look at."""
    tables = make_records(ACTUATORS["arm"], {"rubbing_spot": 1.0}, SEED, only=RECORDS)
    write_set(tmp_path, ACTUATORS["arm"], tables)
    declared = declared_rig(tmp_path / "rig.toml", tmp_path / "cam.csv")
    found = diagnose(declared, load_records(tmp_path, flatten(declared), hold_out=[HELD_OUT]), catalogue=())
    assert found.unnamed
    assert any("unnamed" in text for fit in found.fits for text in fit.unidentified())
    assert not [text for text in (*found.unidentified, *found.next_steps) if "unnamed" in text]


@pytest.mark.slow
def test_what_repeats_in_time_is_refused() -> None:
    made = case("wrist", "periodic_disturbance", RECORDS[:3])
    assert made.excess(made.base, "motor", "fit") > 1.0
    assert made.part("motor") is None


@pytest.mark.slow
def test_nothing_is_added_to_noise() -> None:
    made = case("arm", "none", RECORDS[:3])
    assert made.part("motor") is None
    assert made.part("spring") is None


@pytest.mark.slow
def test_the_table_lies_where_the_cam_rubs_and_is_as_high() -> None:
    made = case("arm", "rubbing_spot")
    candidate = made.part("motor")
    assert candidate is not None
    row = candidate.assembly.quantities()["unnamed_friction.friction"].values
    low, high = (
        candidate.assembly.quantities()[f"unnamed_friction.{n}"].number for n in ("lowest", "highest")
    )
    centres = low + (high - low) / (len(row) - 3) * np.arange(-1, len(row) - 1)
    assert abs(centres[int(np.argmax(row))] - SPOT_PLACE) < 0.06
    hidden = truth(ACTUATORS["arm"], {"rubbing_spot": 1.0}, SEED)[1]
    assert 0.5 * hidden.spot_friction < max(row) < 1.5 * hidden.spot_friction
    far = [v for c, v in zip(centres, row, strict=True) if abs(c - SPOT_PLACE) > 0.3]
    assert max(far) < 0.15 * max(row)


@pytest.mark.slow
def test_its_deck_is_read_by_every_command(tmp_path: Path) -> None:
    made = case("arm", "rubbing_spot")
    candidate = made.part("motor")
    assert candidate is not None
    after = made.comparison.with_effect(made.base, candidate)
    assert after is not None
    write_deck(after.fitted, tmp_path / "model.toml")
    text = (tmp_path / "model.toml").read_text(encoding="utf-8")
    assert "UnnamedFriction" in text
    again = declare(load_deck(tmp_path / "model.toml"))
    same = predict(again, made.records, HELD_OUT)
    for name, values in predict(after.fitted, made.records, HELD_OUT).signals.items():
        assert same[name] == pytest.approx(values, rel=1e-6, abs=1e-9)
    model, time = flatten(again), np.linspace(0.0, 0.5, 51)
    current = 0.4 * np.sin(12.0 * time)
    plain = simulate(model, time, inputs={"motor.current": current}, tolerance=1e-6)
    compiled = simulate(model, time, inputs={"motor.current": current}, tolerance=1e-6, translate=natively)
    assert compiled["motor.angle"] == pytest.approx(plain["motor.angle"], abs=1e-7)
    assert np.ptp(plain["motor.angle"]) > 0.01


@pytest.mark.long_cases("wrist-strain_stiffening-spring")
@pytest.mark.parametrize(("actuator", "effect", "block"), CASES)
def test_it_is_a_candidate_like_others_but_not_of_the_catalogue(
    actuator: str, effect: str, block: str
) -> None:
    made = case(actuator, effect)
    candidate = made.part(block)
    assert candidate is not None
    assert candidate.effect == EFFECT
    assert EFFECT not in {row.__name__ for row in ALL}
    assert "no name" in candidate.signature
    known = candidate.assembly.quantities()
    for unknown in candidate.unknowns:
        assert unknown.name.partition("[")[0] in known
        assert unknown.lower < unknown.upper
        assert unknown.null == 0.0
    reading = candidate.assembly["force_sensor"]
    assert reading.of == made.base.assembly["force_sensor"].of == "spring.cable.force"
