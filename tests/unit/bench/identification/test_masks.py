"""Masked samples: no residual that depends on one counts, and they keep their place through cuts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import RecordSet
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.records.measurement import Record, cut_in_time
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from tests.unit.bench.identification.test_order_of_records import COLUMNS, SIGNALS, record

FORCE, PLACE = "force_sensor.reading", 200


def masked(place: int) -> Record:
    whole = record("a", 0.2, 1e-3)
    mask = np.zeros(len(whole.trace), dtype=bool)
    mask[place] = True
    return replace(whole, masked={FORCE: mask})


@pytest.mark.long_cases("False")
@pytest.mark.parametrize("coarse", [False, True])
def test_no_residual_that_touches_a_masked_sample_counts(coarse: bool) -> None:
    """A force that is five times its noise off at a masked sample changes no residual."""
    model = flatten(declare(load_deck("test_rig")))
    blocks = {b.name: b for b in blocks_of(model, tuple(SIGNALS))}
    errors = []
    for height in (0.0, 1.0):
        one = masked(PLACE)
        force = one.trace[FORCE].copy()
        force[PLACE] += height
        one = replace(one, trace=replace(one.trace, signals={**one.trace.signals, FORCE: force}))
        bench = Bench(RecordSet((one,), COLUMNS), list(blocks.values()))
        driven = bench.driven(blocks["spring"], [])
        (seen,) = bench.evidence(driven, bench.records.records, model.values, coarse=coarse)
        errors.append(seen.residual({})[0])
    assert errors[0].size > 50
    np.testing.assert_array_equal(*errors)


def test_rows_far_from_a_masked_sample_still_count() -> None:
    blocks = blocks_of(flatten(declare(load_deck("test_rig"))), tuple(SIGNALS))
    whole, part = (
        Bench(RecordSet((each,), COLUMNS), blocks) for each in (record("a", 0.2, 1e-3), masked(PLACE))
    )
    assert whole.clock == part.clock
    lost = set(whole.block_noise["spring"].floors["a"].places) - set(
        part.block_noise["spring"].floors["a"].places
    )
    assert lost
    step = part.records.records[0].step
    assert all(abs(place * step - PLACE * 1e-3) < 0.06 for place in lost)


def test_interpolated_samples_show_neither_noise_nor_counts() -> None:
    whole = record("a", 0.2, 1e-3)
    counted = np.round(whole.trace[FORCE])
    counted[PLACE] = 0.3
    trace = replace(whole.trace, signals={**whole.trace.signals, FORCE: counted})
    assert replace(whole, trace=trace).resolution_of(FORCE).quantum < 0.5
    assert replace(masked(PLACE), trace=trace).resolution_of(FORCE).quantum == 1.0


def test_a_mask_is_cut_with_its_record() -> None:
    first, second = cut_in_time(masked(PLACE), 0.1)
    assert not first.masked_in([FORCE]).any()
    assert np.flatnonzero(second.masked_in([FORCE])).tolist() == [PLACE - len(first.trace)]
    assert not second.masked_in(["motor_encoder.reading"]).any()
