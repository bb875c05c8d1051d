"""What a model with given numbers says of a record: a spring pulled by hand."""

from __future__ import annotations

import numpy as np
import pytest

from nlsdesign.bench.discrepancy import predict
from nlsdesign.bench.identification import Record, RecordSet
from nlsdesign.bench.identification.records.mapping import Column
from nlsdesign.components import TRANSLATION, Driven, ForceSensor, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import UnknownNameError
from nlsdesign.simulation import Trace

UNITS = {"grip.position": "m", "cell.reading": "N"}
MODEL = assembly(
    "pulled",
    grip=Driven(domain=TRANSLATION),
    strip=tie(Spring(stiffness=1000.0), "grip"),
    cell=ForceSensor(of="strip.force"),
)


def pulled(name: str, size: float) -> Record:
    """A force that is a tenth larger than the model says."""
    time = np.arange(500) * 2e-3
    way = size * np.sin(6.0 * time)
    return Record(name, Trace(time, {"grip.position": way, "cell.reading": 1100.0 * way}, UNITS, name))


RECORDS = RecordSet(
    (pulled("weak", 0.01), pulled("strong", 0.03)), tuple(Column(n, n, u) for n, u in UNITS.items())
)


def test_the_force_follows_from_the_measured_motion_of_the_record_that_is_asked_for() -> None:
    strong = RECORDS.records[1].trace
    said = predict(MODEL, RECORDS, "strong")
    assert set(said.signals) == {"cell.reading"}
    np.testing.assert_allclose(said["cell.reading"], 1000.0 * strong["grip.position"], atol=1e-9)
    np.testing.assert_array_equal(said.time, strong.time)
    assert (said.units["cell.reading"], said.name) == ("N", "strong")
    assert said.warnings == ()


def test_a_record_that_is_not_there_is_named_with_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="strong"):
        predict(MODEL, RECORDS, "stronk")
