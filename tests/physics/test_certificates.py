"""What a certificate claims, against brute force: two runs of the observer, and the rubber integrated apart.

The truth is written here from the equations of the model with other numbers: one relaxing strain that is led
by the angle, filtered exactly over a twentieth of a sample. The spectral norms are NumPy's.
"""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.feedback.observer import (
    Assumptions,
    CascadeGain,
    Certificate,
    CertifiedGain,
    ConstantGain,
    Contraction,
    ObserverDesign,
    certify,
    design_observer_with_details,
    observe,
    verify,
)
from nlsdesign.feedback.observer.certificates.torque_bound import torque_bound
from nlsdesign.foundation.arrays import Array
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import ValueRangeError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.simulation import Trace
from tests import renamed as rn

DECKS = ("austin2015_as_printed", "austin2015_figure_consistent")
VISCOSITY, MODULUS = "spring.rubber.relaxing.dashpot.viscosity", "spring.rubber.relaxing.spring.modulus"
STRAIN = "spring.rubber.relaxing.dashpot.strain"
TIME = 1e-3


def plant(deck: str, viscosity: float | None = None) -> FlatModel:
    model = flatten(declare(load_deck(deck)))
    return model if viscosity is None else model.with_values({VISCOSITY: viscosity})


def without_torque(model: FlatModel, design: ObserverDesign) -> Certificate[Contraction]:
    """Certify over a short range of angles: the contraction is for all angles anyway."""
    return certify(model, design, assumptions=Assumptions((0.3, 0.302)))


@pytest.mark.long_cases("austin2015_as_printed-411.0", "austin2015_as_printed-411000.0")
@pytest.mark.parametrize(
    ("deck", "viscosity"),
    [
        pytest.param(deck, eta, marks=[] if (deck == DECKS[1]) == (eta == 31e3) else pytest.mark.slow)
        for deck in DECKS
        for eta in (411.0, 31e3, 411e3)
    ],
)
def test_both_decks_are_certified_with_their_dry_friction(deck: str, viscosity: float) -> None:
    """k/η bounds the decay where it is slow; 80 % of it is reached, with P of condition at most 100."""
    model = plant(deck, viscosity)
    assert model.values["dry_friction.sliding_effort"] > 0.0
    design = design_observer_with_details(model, gain=CertifiedGain())
    found = without_torque(model, design)
    relaxation = model.values[MODULUS] / viscosity
    low, high = found.proof.polytope.friction
    assert low < 0.01, "stuck is in the sector"
    assert high > 0.99, "and sliding"
    assert found.proof.decay >= 0.8 * min(relaxation, 2.0 * math.pi * 20.0)
    assert found.proof.decay < relaxation
    assert np.linalg.cond(found.proof.lyapunov) <= 100.0
    root = np.linalg.cholesky(found.proof.lyapunov).T
    norms = np.linalg.norm(root @ found.proof.polytope.corners() @ np.linalg.inv(root), 2, axis=(1, 2))
    assert np.max(norms) <= math.exp(-found.proof.decay * TIME)
    assert np.max(norms) > math.exp(-1.1 * found.proof.decay * TIME), "the proof is not far from what is true"


@pytest.mark.long_cases("austin2015_as_printed-0.002-gain1")
@pytest.mark.parametrize(
    ("deck", "time", "gain"),
    [
        ("austin2015_figure_consistent", 1e-3, CascadeGain()),
        ("austin2015_as_printed", 2e-3, CertifiedGain()),
        ("austin2015_stiff_spring", 1e-3, CertifiedGain()),
    ],
)
def test_two_runs_approach_each_other_in_every_sample(
    deck: str, time: float, gain: CascadeGain | CertifiedGain
) -> None:
    """Angles that jump anywhere, also beyond the table, and through the corner of dry friction."""
    model = plant(deck)
    design = design_observer_with_details(model, gain=gain, sample_time=time)
    found = without_torque(model, design)
    draw, names = np.random.default_rng(3), found.proof.polytope.states
    end = 1.2 * float(design.compact.angles[-1])
    for size, current in ((end, 20.0), (2e-3, 0.5)):
        angle = size * draw.uniform(-1.0, 1.0, 400)
        record = Trace(
            np.arange(400) * time,
            {"motor.angle": angle, "motor.current": draw.uniform(-current, current, 400)},
            {"motor.angle": "rad", "motor.current": "A"},
        )
        runs = []
        for _ in range(2):
            wrong = {
                f"{n}.memory": 0.3 * s * draw.normal()
                for n, s in zip(names, found.proof.polytope.sizes, strict=True)
            }
            run = observe(design.model, record, start=wrong)
            runs.append(np.array([run[n if n != "motor.angle" else "motor.angle.estimate"] for n in names]))
        apart = (runs[0] - runs[1]) / np.array(found.proof.polytope.sizes)[:, None]
        energy = np.sqrt(np.einsum("ik,ij,jk->k", apart, found.proof.lyapunov, apart))
        seen = energy[:-1] > 1e-9
        assert np.sum(seen) > 20
        ratio = energy[1:][seen] / energy[:-1][seen]
        assert np.max(ratio) <= math.exp(-found.proof.decay * time) * (1.0 + 1e-6)


def test_a_gain_without_certificate_is_told() -> None:
    """A gain that overshoots by more than the whole innovation: no run forgets where it began."""
    model = plant("austin2015_figure_consistent")
    wild = design_observer_with_details(model, gain=ConstantGain(((0.0,), (2.2,), (10.0,))))
    with pytest.raises(Exception, match="no quadratic Lyapunov function"):
        without_torque(model, wild)


# --- the torque -------------------------------------------------------------------------------------


def rubber(model: FlatModel, angle: Array, step: float, torque: str) -> Array:
    """Return the torque of a model along angles, its relaxing strain filtered exactly between them."""
    s, names = model.symbols(), [v.name for v in model.states]
    z, theta = ca.SX.sym("z"), ca.SX.sym("theta")
    place = next(i for i, n in enumerate(names) if n not in ("motor.angle", "motor.speed"))
    x = ca.vertcat(*[{place: z, names.index("motor.angle"): theta}.get(i, 0.0) for i in range(len(names))])
    known = {v.name: s.output[i] for i, v in enumerate(model.outputs)}
    known |= {v.name: s.signal[i] for i, v in enumerate(model.signals)}
    numbers = ca.DM(model.start(model.parameters))
    everything = ca.vertcat(s.time, s.state, s.input, s.parameter)
    given = ca.vertcat(0.0, x, ca.DM.zeros(len(model.inputs)), numbers)
    f = ca.Function(
        "f", [z, theta], [ca.substitute(e, everything, given) for e in (s.derivative[place], known[torque])]
    )
    rest_rate = np.array(f(np.zeros(len(angle)), angle)[0]).ravel()
    rate = rest_rate[0] - float(f(1.0, angle[0])[0])
    strain, keep = rest_rate / rate, math.exp(-rate * step)
    for k in range(1, len(strain)):
        led = (rest_rate[k] + rest_rate[k - 1]) / (2.0 * rate)
        strain[k] = keep * strain[k - 1] + (1.0 - keep) * led
    return np.array(f(strain, angle)[1]).ravel()


def wandering(draw: np.random.Generator, count: int, *, end: float, speed: float) -> Array:
    """Return angles, twenty a sample, that turn around at random and never leave the range."""
    angle, going = np.empty(20 * count + 1), 0.0
    angle[0] = draw.uniform(-end, end)
    for k in range(20 * count):
        if draw.random() < 0.003:
            going = draw.choice([-1.0, 1.0, 0.0, 0.1 * draw.normal()]) * speed
        going = -going if abs(angle[k] + going * TIME / 20.0) > end else going
        angle[k + 1] = angle[k] + going * TIME / 20.0
    return angle


@pytest.mark.parametrize(
    ("deck", "share", "factor"),
    [pytest.param("austin2015_figure_consistent", 0.0, 15.0, marks=pytest.mark.slow),
     ("austin2015_figure_consistent", 1.0, 4.0),
     pytest.param("austin2015_as_printed", 0.3, 15.0, marks=pytest.mark.slow)],
)  # fmt: skip
def test_the_torque_never_errs_by_more_than_the_bound(deck: str, share: float, factor: float) -> None:
    """Any current, turns within a sample, a quantised angle, parameters at the corners of their ranges."""
    model, draw = plant(deck), np.random.default_rng(5)
    design = design_observer_with_details(model)
    torque, quantum = design.step.plant.estimate.name, model.values["motor_encoder.quantum"]
    spreads = {v.name: share * v.spread.share(v.start) for v in model.parameters if share > 0.0 and v.spread}
    bound = torque_bound(model, design, Assumptions((-0.6, 0.6), 15.0, quantum / 2.0, spreads))
    assert bound.total == pytest.approx(sum(bound.causes.values()))
    worst = 0.0
    for trial in range(3):
        stiffer = [-1.0 if "rest_length" in n or "knots" in n else 1.0 for n in spreads]
        sign = draw.choice([-1.0, 1.0], size=len(spreads)) if trial else np.array(stiffer)
        values = {n: model.values[n] * (1.0 + s * k) for (n, s), k in zip(spreads.items(), sign, strict=True)}
        angle = wandering(draw, 500, end=0.599, speed=15.0)
        true = rubber(model.with_values(values), angle, TIME / 20.0, torque)[::20]
        counts = np.round(angle[::20] / quantum) * quantum
        record = Trace(
            np.arange(len(counts)) * TIME,
            {"motor.angle": counts, "motor.current": draw.uniform(-20.0, 20.0, len(counts))},
            {"motor.angle": "rad", "motor.current": "A"},
        )
        found = observe(design.model, record, start=design.start(float(counts[0])))[torque]
        worst = max(worst, float(np.max(np.abs(found - true)[1:])))
    assert worst <= bound.total
    assert worst > bound.total / factor


@pytest.mark.slow
def test_a_coarser_encoder_widens_the_bound_and_the_others_stay() -> None:
    model = plant("austin2015_figure_consistent")
    design = design_observer_with_details(model)
    fine, coarse = (
        torque_bound(model, design, Assumptions((0.3, 0.305), 5.0, error)) for error in (4e-4, 6.4e-3)
    )
    assert coarse.encoder == pytest.approx(16.0 * fine.encoder, rel=0.05)
    assert coarse.motion == pytest.approx(fine.motion, rel=1e-2)


# Quicker: of the same name in test_continuous_certificates.py
@pytest.mark.slow
def test_names_do_not_matter() -> None:
    machine = rn.renamed(declare(load_deck("austin2015_figure_consistent")), rn.exchanged)
    one, other = plant("austin2015_figure_consistent"), flatten(machine.assembly)
    found = [
        certify(m, design_observer_with_details(m), assumptions=Assumptions((0.3, 0.302), angle_error=1e-4))
        for m in (one, other)
    ]
    assert found[0].proof.decay == pytest.approx(found[1].proof.decay, rel=1e-6)
    assert found[0].proof.torque.total == pytest.approx(found[1].proof.torque.total, rel=1e-6)  # type: ignore[union-attr]
    assert verify(found[1], model=other).holds


# Quicker: of the same name in test_continuous_certificates.py
@pytest.mark.slow
def test_what_is_too_fast_is_answered_with_the_fastest() -> None:
    model = plant("austin2015_figure_consistent", 31e3)
    limit = model.values[MODULUS] / 31e3
    with pytest.raises(ValueRangeError, match="nothing corrects the rubber") as slow:
        design_observer_with_details(model, gain=CertifiedGain(decay=1.5 * limit))
    named = float(str(slow.value).split("proved is ")[1].split(" 1/s")[0])
    assert 0.95 * limit < named < limit
    with pytest.raises(ValueRangeError, match="what the sample rate carries"):
        design_observer_with_details(model, gain=CertifiedGain(bandwidth=400.0))
    cascade = design_observer_with_details(model)
    with pytest.raises(ValueRangeError, match="the fastest that can is"):
        certify(model, cascade, decay=2.0 * limit)


def test_a_wrong_decay_is_refuted_by_the_mathematics() -> None:
    """The file is written anew with a decay a tenth too fast, so that no checksum can tell."""
    model = plant("austin2015_as_printed", 31e3)
    found = without_torque(model, design_observer_with_details(model))
    assert verify(found).holds
    forged = verify(replace(found, proof=replace(found.proof, decay=1.1 * found.proof.decay)))
    assert [c.name for c in forged.checks if c.holds is False] == ["contraction", "condition of P"]
