"""Records of the rig with force noise that remembers: a clean set is at its floor, an effect stays above."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from nlsdesign.bench.discrepancy.screening.scale_and_sign import typical_sizes
from nlsdesign.bench.discrepancy.selection.comparison import Comparison
from nlsdesign.bench.discrepancy.selection.criteria import Criteria
from nlsdesign.bench.discrepancy.selection.hypothesis import excesses
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.components import Assembly
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace
from tests.diagnosed import declared_rig
from tests.rig import ACTUATORS, make_records, write_set

FORCE = "force_sensor.reading"
WHITE = ACTUATORS["arm"].sensors.force_noise
ONLY = ("sine_25deg_2.0Hz", "sine_15deg_5.0Hz", "hold", "multisine")


def bench_set(folder: Path, effects: Mapping[str, float], seed: int = 7) -> tuple[Assembly, RecordSet]:
    write_set(folder, ACTUATORS["arm"], make_records(ACTUATORS["arm"], effects, seed, only=ONLY))
    declared = declared_rig(folder / "rig.toml", folder / "cam.csv")
    return declared, load_records(folder, flatten(declared))


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> tuple[Assembly, RecordSet]:
    return bench_set(tmp_path_factory.mktemp("clean"), {})


@pytest.fixture(scope="module")
def disturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Assembly, RecordSet]:
    return bench_set(tmp_path_factory.mktemp("disturbed"), {"periodic_disturbance": 1.0})


def coloured(records: RecordSet, time: float, share: float) -> RecordSet:
    """The records with a first-order process of a share of the variance of the white force noise."""
    changed = []
    for place, record in enumerate(records.records):
        memory, draw = np.exp(-record.step / time), np.random.default_rng([place, 11])
        white = draw.standard_normal(len(record.trace) + 2000) * WHITE * np.sqrt(share * (1.0 - memory**2))
        added = lfilter([1.0], [1.0, -memory], white)[2000:]
        trace = record.trace
        signals = {**trace.signals, FORCE: trace[FORCE] + added}
        changed.append(replace(record, trace=Trace(trace.time, signals, trace.units, trace.name)))
    return replace(records, records=tuple(changed))


def judged(declared: Assembly, records: RecordSet) -> tuple[Bench, dict[str, tuple[float, bool]]]:
    """The bench, and of each block the mean square in units of its floor, and whether it is open."""
    bench = Bench(records, blocks_of(flatten(declared), records.signals))
    comparison = Comparison(bench, typical_sizes(declared, bench.records))
    found = excesses(comparison.base(declared), bench, Criteria())
    return bench, {name: (e.mean_square, e.open) for name, e in found.items() if name in bench.block_noise}


@pytest.mark.long_cases("0.1-3.0", "0.005-1.0", "0.02-1.0", "0.1-1.0", "0.02-3.0")
@pytest.mark.parametrize(("time", "share"), [(0.005, 1.0), (0.02, 1.0), (0.02, 3.0), (0.1, 1.0), (0.1, 3.0)])
def test_a_clean_set_with_coloured_force_noise_is_at_its_floor(
    clean: tuple[Assembly, RecordSet], time: float, share: float
) -> None:
    declared, records = clean
    bench, blocks = judged(declared, coloured(records, time, share))
    assert bench.noise.evidence[FORCE] in ("rest", "repetition")
    assert bench.noise.deviation(FORCE) == pytest.approx(WHITE * np.sqrt(1.0 + share), rel=0.3)
    for mean_square, is_open in blocks.values():
        assert 0.5 < mean_square < 1.4
        assert not is_open


# Quicker: a line is no noise in unit/bench/identification/test_coloured.py
@pytest.mark.slow
def test_a_periodic_disturbance_is_no_noise(disturbed: tuple[Assembly, RecordSet]) -> None:
    declared, records = disturbed
    bench, blocks = judged(declared, coloured(records, 0.02, 1.0))
    assert blocks["motor"][0] > 20.0
    assert blocks["motor"][1]
    assert bench.noise.deviation(FORCE) < 1.3 * WHITE * np.sqrt(2.0)


@pytest.mark.long_cases(
    "coulomb_friction", "none", "second_relaxation", "rate_independent_hysteresis", "torque_ripple"
)
@pytest.mark.parametrize(
    "effect",
    ["none", "coulomb_friction", "second_relaxation", "rate_independent_hysteresis", "torque_ripple"],
)
def test_what_is_hidden_is_not_taken_for_noise(tmp_path: Path, effect: str) -> None:
    declared, records = bench_set(tmp_path, {effect: 1.5})
    noise = Bench(records, blocks_of(flatten(declared), records.signals)).noise
    assert noise.deviation(FORCE) == pytest.approx(WHITE, rel=0.15)
    # A Gaussian that leaves as much of white noise as the mean of nine samples.
    width = 9.0 / (2.0 * np.sqrt(np.pi)) * 0.002
    assert noise.behind(FORCE, 0.002, width=width) == pytest.approx(WHITE / 3.0, rel=0.15)
