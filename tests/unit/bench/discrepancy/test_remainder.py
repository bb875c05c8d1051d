"""What is said of an error without a name, on errors made here with known shape."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.effects.unnamed_tables import unnamed_part
from nlsdesign.bench.discrepancy.reporting.advice import advice, experiment
from nlsdesign.bench.discrepancy.reporting.remainder import sparse_formula
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.least_squares import Fit
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck


def motion(seed: int) -> tuple[Array, Array]:
    """Angle and speed of a sum of three sines."""
    draw = np.random.default_rng(seed)
    time = np.arange(0.0, 10.0, 0.01)
    rates, phases = draw.uniform(1.0, 9.0, 3), draw.uniform(0.0, 6.0, 3)
    angle = sum(np.sin(w * time + p) / 3 for w, p in zip(rates, phases, strict=True))
    speed = sum(w * np.cos(w * time + p) / 3 for w, p in zip(rates, phases, strict=True))
    return np.asarray(angle), np.asarray(speed)


def parts(law: str) -> list[tuple[Array, dict[str, Array], bool]]:
    found = []
    for seed in range(4):
        angle, speed = motion(seed)
        noise = 0.01 * np.random.default_rng(100 + seed).standard_normal(len(angle))
        error = {
            "cubic": 0.5 * angle**3,
            "dry": 0.2 * np.sign(speed) * np.abs(angle),
            "noise": np.zeros_like(angle),
        }[law] + noise
        found.append((error, {"q": angle, "rate of q": speed}, seed < 3))
    return found


def test_a_cubic_force_is_written_as_one_term() -> None:
    found = sparse_formula(parts("cubic"), "N")
    assert found is not None
    assert list(found.terms) == ["[q]³"]
    assert found.terms["[q]³"] == pytest.approx(0.5, rel=0.02)
    assert found.share > 0.95


def test_friction_in_proportion_to_the_angle_is_written_as_one_term() -> None:
    found = sparse_formula(parts("dry"), "N")
    assert found is not None
    assert list(found.terms) == ["sign([rate of q])·|[q]|"]
    assert found.terms["sign([rate of q])·|[q]|"] == pytest.approx(0.2, rel=0.02)


LAWS = {
    "1": lambda q, v: np.ones_like(q),
    "[q]": lambda q, v: q,
    "|[q]|": lambda q, v: np.sqrt(q * q),
    "[q]²": lambda q, v: q * q,
    "[q]³": lambda q, v: q * q * q,
    "sign([q])": lambda q, v: np.where(q > 0.0, 1.0, -1.0),
    "sign([rate of q])": lambda q, v: np.where(v > 0.0, 1.0, -1.0),
    "[rate of q]·|[rate of q]|": lambda q, v: np.where(v > 0.0, v * v, -v * v),
    "sign([rate of q])·|[q]|": lambda q, v: np.where(v * q > 0.0, q, -q),
    "[rate of q]·[q]": lambda q, v: q * v,
}


@pytest.mark.parametrize("name", LAWS)
def test_each_term_of_the_library_is_what_its_name_says(name: str) -> None:
    """An error that is nothing but the term, twice over, in three records and in one that is held out."""
    motions = [motion(seed) for seed in range(4)]
    errors = [(2.0 * LAWS[name](q, v), {"q": q, "rate of q": v}, k < 3) for k, (q, v) in enumerate(motions)]
    found = sparse_formula(errors, "N*m")
    assert found is not None
    assert found.terms == {name: pytest.approx(2.0)}
    assert found.share == pytest.approx(1.0)
    assert found.text == f"2·{name} (in N·m, signals in SI)"


def test_a_second_term_that_resembles_the_first_is_told_from_it() -> None:
    """A cube beside its line, which looks much the same: what the line leaves of it counts in full."""
    motions = [motion(seed) for seed in range(4)]
    errors = [(q + 1.5 * q**3, {"q": q, "rate of q": v}, k < 3) for k, (q, v) in enumerate(motions)]
    found = sparse_formula(errors, "N")
    assert found is not None
    assert found.terms == {"[q]": pytest.approx(1.0), "[q]³": pytest.approx(1.5)}


def test_no_formula_is_written_for_noise() -> None:
    assert sparse_formula(parts("noise"), "N") is None


def test_each_alias_gets_a_sentence_with_an_experiment_or_a_place() -> None:
    said = advice("cable_slack", {"permanent_set": "here", "brand_new": "they differ in 'a'"})
    assert len(said) == 2
    assert str(experiment("permanent_set", "cable_slack")) in said[0]
    assert said[1] == "cable_slack or brand_new: they differ in 'a'."


def test_a_command_that_is_not_explained_has_no_place_for_a_table() -> None:
    servo = declare(load_deck("xl330_pendulum"))
    fit = SimpleNamespace(values={}, parameters=())
    signals = ("encoder.reading", "servo.goal", "servo.wanted_voltage")
    bench = SimpleNamespace(records=SimpleNamespace(signals=signals))
    assert unnamed_part(servo, cast(Fit, fit), cast(Bench, bench), "servo.wanted_voltage") is None
