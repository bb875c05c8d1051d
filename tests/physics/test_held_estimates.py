"""How far the estimate of an adaptive observer can go, against slow states set by an adversary.

The observer runs through its own equations. Before each sample the memory of its slow states is set to
corners of their box, which no measurement could do worse, and the angle jumps. The truth is the cascade
without any slow state, run beside it.
"""

from __future__ import annotations

import re
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.feedback.observer import (
    AdaptiveDesign,
    AdaptiveSettings,
    Assumptions,
    CascadeGain,
    FixedGrid,
    Trust,
    certify_held_estimate,
    design_adaptive_observer,
    design_observer_with_details,
    read_certificate,
    verify,
    write_certificate,
)
from nlsdesign.feedback.observer.certificates.held_estimate import HeldEstimate, held_estimate_bound
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation.prior import declared_prior

STRAIN = "spring.rubber.relaxing.dashpot.strain"
GRID = FixedGrid(-1.1, 1.1, 45)
RANGES = Assumptions((0.3, 0.32), 15.0, 4e-4)


def plant(deck: str = "austin2015_figure_consistent") -> FlatModel:
    return flatten(declare(load_deck(deck)))


def designed(model: FlatModel, limit: float) -> AdaptiveDesign:
    rubber = ("rubber.relaxing.dashpot.viscosity", "rubber.relaxing.spring.modulus", "rubber.area")
    known = declared_prior(model).only([f"spring.{name}" for name in rubber])
    settings = AdaptiveSettings(prior=known, trust=Trust(limit=limit))
    return design_adaptive_observer(model, settings=settings, grid=GRID)


@pytest.fixture(scope="module")
def gentle() -> AdaptiveDesign:
    return designed(plant(), 2.0)


def strayed(design: AdaptiveDesign, model: FlatModel, *, samples: int, held: int) -> tuple[float, float]:
    """Return the largest distance of the estimate from the cascade's, and the largest inner state."""
    observer, draw = design.model, np.random.default_rng(6)
    plain = design_observer_with_details(model, gain=CascadeGain(), grid=GRID).model
    names = [v.name for v in observer.states]
    slow = [i for i, n in enumerate(names) if ".deviation[" in n]
    state, other = observer.start(observer.states), plain.start(plain.states)
    limit, worst, inner = design.trust.limit, 0.0, 0.0
    signs = np.ones(len(slow))
    strain = [v.name for v in observer.outputs].index(STRAIN)
    angle = 0.0
    for k in range(samples):
        if k % held == 0:
            signs = draw.choice([-1.0, 1.0], len(slow))
            angle = draw.choice([-1.0, 1.0, 0.0, draw.uniform(-1.0, 1.0)]) * 1.1
        state[slow] = limit * signs
        # Confident of its slow states, so that they stay where the adversary put them.
        state[[i for i, n in enumerate(names) if n.startswith("covariance")]] = 0.0
        u = [angle, draw.uniform(-20.0, 20.0)]
        numbers = np.zeros(0)
        given = observer.equations(0.0, state, u, numbers, observer.look_up(list(state), u))
        truth = plain.equations(0.0, other, u, numbers, plain.look_up(list(other), u))
        state, other = np.array(given[0]).ravel(), np.array(truth[0]).ravel()
        estimate = float(given[1][0])
        if not np.isfinite(estimate):
            return np.inf, np.inf
        worst = max(worst, abs(estimate - float(truth[1][0])))
        inner = max(inner, abs(float(given[1][strain])))
    return worst, inner


def test_an_adversary_stays_within_the_bound(gentle: AdaptiveDesign) -> None:
    model = plant()
    bound = held_estimate_bound(model, gentle, RANGES)
    found = [strayed(gentle, model, samples=count, held=held) for count, held in ((60, 3), (180, 60))]
    worst, inner = (max(each) for each in zip(*found, strict=True))
    assert inner <= max(map(abs, bound.boxes[STRAIN]))
    assert inner > 0.6 * max(map(abs, bound.boxes[STRAIN])), "the box is not far too wide"
    assert worst <= bound.learned
    assert worst > bound.learned / 6.0


def test_slow_states_that_stop_the_rubber_from_decaying_are_refused(gentle: AdaptiveDesign) -> None:
    """At four deviations the inner state runs away; the limit that is named holds, the default is below."""
    model, trust = plant(), Trust(limit=4.0)
    wild = replace(gentle, trust=replace(gentle.trust, limit=trust.limit))
    with pytest.raises(ValueRangeError, match="held up to") as refused:
        held_estimate_bound(model, wild, RANGES)
    named = re.search(r"Trust\(limit=([\d.]+)\)", str(refused.value))
    assert named is not None
    assert Trust().limit < float(named[1]) < trust.limit
    held = replace(gentle, trust=replace(gentle.trust, limit=float(named[1])))
    assert held_estimate_bound(model, held, RANGES).limit == float(named[1])
    places = gentle.compact.places
    kept, d = places["next[0][0]"].factor, 0
    while f"next.{d}[0][0]" in places:
        kept += trust.limit * abs(places[f"next.{d}[0][0]"].factor)
        d += 1
    assert kept > 1.0, "what is kept of the inner state in a sample, at the corner of the slow states"


def test_the_bound_grows_with_the_limit_and_vanishes_with_it(gentle: AdaptiveDesign) -> None:
    model = plant()
    found = [
        held_estimate_bound(model, replace(gentle, trust=replace(gentle.trust, limit=limit)), RANGES)
        for limit in (1e-4, 0.1, 1.0)
    ]
    assert found[0].learned < 1e-3
    assert found[0].learned < found[1].learned < found[2].learned
    assert found[0].cascade == found[2].cascade
    with pytest.raises(ValueRangeError, match="spreads"):
        held_estimate_bound(model, gentle, replace(RANGES, spreads={"spring.rubber.area": 0.1}))


def test_a_file_is_checked_again_with_the_observer(tmp_path: Path) -> None:
    """On a spring of steel without inner states; a smaller bound, written anew, is refuted."""
    model = plant("austin2015_stiff_spring")
    design = design_adaptive_observer(model)
    ranges = Assumptions((-0.5, 0.5), 15.0, 4e-4)
    proved = certify_held_estimate(model, design, assumptions=ranges, settings=asdict(design.trust))
    path = write_certificate(proved, tmp_path / "certificate.json")
    again, untouched = read_certificate(path)
    assert isinstance(again.proof, HeldEstimate)
    assert untouched
    assert verify(again, untouched=untouched, model=model, design=design).holds
    assert [c.holds for c in verify(again).checks] == [True, None]
    assert [c.holds for c in verify(again, model=model).checks] == [True, True], "designed again"
    smaller = replace(proved.proof.bound, learned=0.9 * proved.proof.bound.learned)
    forged = replace(proved, proof=replace(proved.proof, bound=smaller))
    read, untouched = read_certificate(write_certificate(forged, path))
    found = verify(read, untouched=untouched, model=model, design=design)
    assert untouched
    assert [c.name for c in found.checks if c.holds is False] == ["bound of the estimate"]
