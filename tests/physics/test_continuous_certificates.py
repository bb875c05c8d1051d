"""Certificates in continuous time against the equations of the model itself, and against what they refuse.

The proof works with bounds of slopes. Here the rates of two states of the machine are subtracted, by no slope
at all, with any angle, speeds on both sides of the corner of dry friction, and any current.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.feedback.observer import (
    Certificate,
    Minimal,
    PaperForm,
    certify_continuous,
    read_certificate,
    verify,
    write_certificate,
)
from nlsdesign.feedback.observer.certificates.continuous import ContinuousContraction
from nlsdesign.feedback.observer.certificates.error_system import hull
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.model.paper_form import GEOMETRIC, paper_form
from tests import renamed as rn

DECKS = ("austin2015_as_printed", "austin2015_figure_consistent")
VISCOSITY, MODULUS = "spring.rubber.relaxing.dashpot.viscosity", "spring.rubber.relaxing.spring.modulus"


def plant(deck: str, viscosity: float | None = None) -> FlatModel:
    model = flatten(declare(load_deck(deck)))
    return model if viscosity is None else model.with_values({VISCOSITY: viscosity})


def fall(
    model: FlatModel, certificate: Certificate[ContinuousContraction], *, draws: int, reach: float
) -> float:
    """Return the smallest rate at which V falls, over pairs of states at one angle and one current."""
    proved = certificate.proof
    published = isinstance(proved.states, PaperForm)
    carried = paper_form(model) if published else model
    names, draw = [v.name for v in carried.states], np.random.default_rng(4)
    system, size = proved.system, np.array(proved.system.sizes)
    place = [names.index(n) for n in system.states]
    low, high = system.angles
    slowest = np.inf
    p, gain = proved.lyapunov, np.array(proved.gain)
    for k in range(draws):
        angle = draw.uniform(low, high) * reach
        scale = 10.0 ** draw.uniform(-5.0, 0.0)
        pair = draw.normal(size=(2, len(size))) * size * scale
        u = [draw.uniform(-20.0, 20.0) for _ in carried.inputs]
        if published:
            u[0] = 0.0  # what the rate of the extension does is known at the measured angle
        states = np.zeros((2, len(names)))
        states[:, place] = pair
        states[:, names.index(certificate.measured)] = angle
        if published:  # at one angle all extensions are the one that follows from it: A is taken there
            extension = next(n for n in names if n.endswith("extension"))
            first = float(np.array(_signal(carried, states[0], u, f"{extension}.{GEOMETRIC}")))
            near = 1e-7 * draw.normal(size=2)
            states[:, names.index(extension)] = first + (near if k % 2 else 0.0)
        rates = np.array([_rates(carried, x, u) for x in states])
        error = (states[0] - states[1])[place]
        wrong = 10.0 ** draw.uniform(-5.0, 0.0) * draw.normal() * size[system.moving[0]]
        error[system.moving[0]] = wrong  # the angle enters nothing but through what is measured
        rise = (rates[0] - rates[1])[place]
        change = (rise - gain @ error[list(system.seen)]) / size
        e = error / size
        value = float(e @ p @ e)
        if value > 1e-20:
            slowest = min(slowest, -float(e @ p @ change) / value)
    return slowest


def _rates(model: FlatModel, state: Array, u: list[float]) -> Array:
    given = model.start(model.parameters)
    return np.array(model.equations(0.0, state, u, given, [])[0]).ravel()


def _signal(model: FlatModel, state: Array, u: list[float], name: str) -> float:
    values = model.equations(0.0, state, u, model.start(model.parameters), [])[2]
    return float(np.array(values).ravel()[[v.name for v in model.signals].index(name)])


@pytest.mark.long_cases("austin2015_figure_consistent-31000.0-form0", "austin2015_as_printed-411000.0-form0")
@pytest.mark.parametrize("form", [Minimal(), pytest.param(PaperForm(), marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("deck", "viscosity"),
    [
        pytest.param(deck, eta, marks=[] if (deck == DECKS[1]) == (eta == 31e3) else pytest.mark.slow)
        for deck in DECKS
        for eta in (411.0, 31e3, 411e3)
    ],
)
def test_both_decks_are_certified_in_continuous_time(
    deck: str, viscosity: float, form: Minimal | PaperForm
) -> None:
    """80 % of k/η where it is slow, P of condition at most 100; V falls so fast by the equations too."""
    model = plant(deck, viscosity)
    assert model.values["dry_friction.sliding_effort"] > 0.0
    proved = certify_continuous(model, form=form)
    relaxation = model.values[MODULUS] / viscosity
    assert proved.proof.decay >= 0.8 * min(relaxation, 125.0)
    assert proved.proof.decay < relaxation
    assert np.linalg.cond(proved.proof.lyapunov) <= 100.0
    stuck = model.values["dry_friction.sliding_effort"] / (
        model.values["dry_friction.creep_speed"] * model.values["motor.inertia"]
    )
    assert -proved.proof.system.friction[0] >= stuck, "the corner of dry friction is in the sector"
    found = fall(model, proved, draws=400, reach=1.0)
    assert proved.proof.decay <= found
    assert found < 3.0 * relaxation


@pytest.mark.long_cases("411.0-60.0", "411000.0-0.706")
@pytest.mark.parametrize(("viscosity", "reached"), [(411.0, 60.0), (31e3, 9.35), (411e3, 0.706)])
def test_faster_than_a_prototype_with_the_same_condition(viscosity: float, reached: float) -> None:
    """A throw-away prototype had 60, 9.35 and 0.706 1/s for the printed deck, with conditions of 25 to 60."""
    proved = certify_continuous(plant(DECKS[0], viscosity), condition=60.0, decay=1.2 * reached)
    assert proved.proof.decay == pytest.approx(1.2 * reached)
    assert np.linalg.cond(proved.proof.lyapunov) <= 60.0


@pytest.mark.slow
def test_what_is_too_fast_is_answered_with_the_fastest() -> None:
    model = plant(DECKS[1], 31e3)
    limit = model.values[MODULUS] / 31e3
    with pytest.raises(ValueRangeError, match="nothing corrects the rubber") as refused:
        certify_continuous(model, decay=1.5 * limit)
    named = re.search(r"proved is ([\d.e+-]+) 1/s", str(refused.value))
    assert named is not None
    assert 0.9 * limit < float(named[1]) < limit
    assert certify_continuous(model, decay=0.98 * float(named[1])).proof.decay == 0.98 * float(named[1])


@pytest.mark.slow
def test_names_do_not_matter() -> None:
    machine = rn.renamed(declare(load_deck(DECKS[1])), rn.exchanged)
    one, other = (certify_continuous(m, decay=40.0) for m in (plant(DECKS[1]), flatten(machine.assembly)))
    assert np.array(one.proof.gain) == pytest.approx(np.array(other.proof.gain), rel=1e-3)
    assert verify(other, model=flatten(machine.assembly)).holds


# Quicker: unit/feedback/observer/test_certificate_file.py
@pytest.mark.slow
def test_a_file_is_checked_again_and_forgeries_are_refuted(tmp_path: Path) -> None:
    """Each forgery is written anew with a right checksum: a faster decay, and narrower ranges of A."""
    model = plant(DECKS[1])
    proved = certify_continuous(model, decay=40.0)
    path = write_certificate(proved, tmp_path / "certificate.json")
    again, untouched = read_certificate(path)
    assert isinstance(again.proof, ContinuousContraction)
    assert untouched
    assert verify(again, untouched=untouched, model=model).holds
    narrow = [list(row) for row in proved.proof.system.lower]
    speed = proved.proof.system.moving[1]
    narrow[speed][0] *= 0.9
    claimed = replace(proved.proof.system, lower=tuple(map(tuple, narrow)))
    for forged, failing in (
        (replace(proved.proof, decay=80.0), ["decay", "condition of P"]),
        (replace(proved.proof, system=claimed), ["ranges of A"]),
    ):
        read, untouched = read_certificate(write_certificate(replace(proved, proof=forged), path))
        assert untouched
        found = verify(read, untouched=untouched, model=model)
        assert [c.name for c in found.checks if c.holds is False] == failing
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('"decay": 40.0', '"decay": 30.0'), encoding="utf-8")
    read, untouched = read_certificate(path)
    assert not verify(read, untouched=untouched, model=model).holds


def test_a_hull_finds_a_peak_between_its_points() -> None:
    """x² in interval arithmetic written as x·x is twice too wide on each cell: halving decides."""

    def ranges(cells: tuple[Array, Array]) -> tuple[Array, Array, NDArray[np.bool_]]:
        ends = np.array([cells[i] * (1.0 - cells[j]) for i in (0, 1) for j in (0, 1)])
        return ends.min(0)[:, None], ends.max(0)[:, None], np.zeros(len(cells[0]), dtype=bool)

    low, high = hull(ranges, np.array([0.0, 0.4, 1.0]))
    assert low[0] <= 0.0
    assert 0.25 <= high[0] <= 0.25 * 1.01
