"""Softening, set and heat: closed forms, published function, and where every joule goes.

Independent roads: the function of Ogden and Roxburgh with ``math.erf`` on the energy typed here; recoverable
energy by quadrature; the rounded switch by its closed solution; balances of work, stored energy and loss by
Simpson's rule on the signals of the trace.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson, quad
from scipy.optimize import brentq

from nlsdesign.components import (
    TRANSLATION,
    Driven,
    Element,
    HeatBalance,
    LinearElastic,
    NeoHooke,
    OgdenRoxburgh,
    PermanentSet,
    Rising,
    SelfHeating,
    SlidingFillers,
    Spring,
    Springpot,
    StressSoftening,
    ViscousMaterial,
    assembly,
    maxwell,
    parallel,
    specimen,
    tie,
)
from nlsdesign.foundation.errors import ArrangementError, ValueRangeError
from nlsdesign.model import flatten
from nlsdesign.simulation import Trace, simulate
from tests.stretched import AREA, LENGTH, VOLUME, pulled, run

MU, R, M, WIDTH = 0.6e6, 1.8, 0.12e6, 1e-3


def soft(width: float = WIDTH) -> StressSoftening:
    return StressSoftening(
        members=(("law", NeoHooke(shear_modulus=MU)),), curve=OgdenRoxburgh(strength=R, scale=M, width=width)
    )


def energy(strain: np.ndarray) -> np.ndarray:
    stretch = 1.0 + strain
    return MU / 2 * (stretch**2 + 2 / stretch - 3)


def first_stress(strain: np.ndarray) -> np.ndarray:
    return MU * (1.0 + strain - (1.0 + strain) ** -2)


def wave(cycles: list[float], times: np.ndarray) -> tuple[Callable[[float], float], Callable[[float], float]]:
    """Strain that rises to each of the peaks and comes back to zero, one second each."""

    def strain(t: float) -> float:
        number = min(int(t), len(cycles) - 1)
        return cycles[number] * math.sin(math.pi * (t - number)) ** 2

    def rate(t: float) -> float:
        number = min(int(t), len(cycles) - 1)
        return cycles[number] * math.pi * math.sin(2 * math.pi * (t - number))

    return strain, rate


def cycled(law: Element, cycles: list[float], per_second: int = 4000, tolerance: float = 1e-10) -> Trace:
    times = np.linspace(0.0, float(len(cycles)), per_second * len(cycles) + 1)
    return run(pulled(law=law), times, *wave(cycles, times), tolerance)


def work_of(trace: Trace) -> np.ndarray:
    return cumulative_simpson(trace["rubber.force"] * trace["grip.speed"], x=trace.time, initial=0.0)


# --- stress softening -----------------------------------------------------------------------------


def test_softening_is_the_function_of_ogden_and_roxburgh() -> None:
    """η = 1 − erf((W_m − W)/m)/r on the way back and up again, one on first loading."""
    trace = cycled(soft(), [0.5, 0.8, 0.6])
    strain = trace["rubber.strain"]
    greatest = np.maximum.accumulate(energy(strain))
    eta = np.array([1 - math.erf(s / M) / R for s in greatest - energy(strain)])
    expected = AREA * eta * first_stress(strain)
    # The greatest energy lags by less than eight widths, see the next test.
    allowed = 8 * WIDTH / R * 2 / math.sqrt(math.pi) * AREA * first_stress(strain) + 1e-6
    assert np.all(np.abs(trace["rubber.force"] - expected) < allowed)
    assert np.min(trace["rubber.law.softness"]) == pytest.approx(
        1 - math.erf(np.max(greatest) / M) / R, abs=0.005
    )


def test_the_softening_at_rest_tends_to_its_published_limit() -> None:
    """Ogden and Roxburgh 1999: the least η is 1 − erf(W_m/m)/r, so 1 − 1/r after a pull far beyond m."""
    small = StressSoftening(
        members=(("law", NeoHooke(shear_modulus=MU)),), curve=OgdenRoxburgh(strength=R, scale=M / 40)
    )
    assert cycled(small, [0.9])["rubber.law.softness"][-1] == pytest.approx(1 - 1 / R, abs=1e-6)


def test_the_rounded_switch_follows_its_closed_solution() -> None:
    """On first loading the lag d of W_m behind W solves d + w·e^(d/w) = W + w."""
    width = 0.02
    trace = cycled(soft(width), [0.8])
    rising = trace.time <= 0.5
    w = width * M
    for index in np.flatnonzero(rising)[100::300]:
        whole = float(energy(trace["rubber.strain"][index]))
        lag = brentq(lambda d, whole=whole: d + w * math.exp(d / w) - whole - w, 0.0, whole)
        assert whole - trace["rubber.law.greatest_energy"][index] == pytest.approx(lag, rel=1e-5, abs=1e-3)


def test_a_smaller_width_comes_closer_to_the_sharp_law() -> None:
    off = []
    for width in (1e-2, 1e-3):
        trace = cycled(soft(width), [0.7])
        sharp = 1 - math.erf(float(energy(np.array(0.7))) / M) / R
        off.append(abs(trace["rubber.law.softness"][-1] - sharp))
    assert off[1] < off[0] / 5


def test_what_is_lost_in_softening_is_work_minus_what_comes_back() -> None:
    """Work = ∫₀^W η dW' (recoverable, by quadrature) + loss; nothing is lost on a second cycle."""
    trace = cycled(soft(), [0.8, 0.8])
    work = work_of(trace) / VOLUME
    peak = int(np.argmax(trace["rubber.strain"] > 0.8 - 1e-12))
    top = float(energy(np.array(0.8)))
    recoverable = quad(lambda w: 1 - math.erf((top - w) / M) / R, 0.0, top)[0]
    assert work[peak] == pytest.approx(top, rel=1e-5)
    after_one, after_two = work[4000], work[-1]
    assert after_one == pytest.approx(top - recoverable, rel=0.01)
    # By parts, as in the paper: (W_m·erf(W_m/m) + m/√π·(exp(−(W_m/m)²) − 1))/r.
    closed = (top * math.erf(top / M) + M / math.sqrt(math.pi) * (math.exp(-((top / M) ** 2)) - 1)) / R
    assert top - recoverable == pytest.approx(closed, rel=1e-9)
    assert after_two - after_one == pytest.approx(0.0, abs=0.005 * after_one)


@settings(max_examples=settings.default.max_examples // 10, deadline=None)
@given(st.lists(st.floats(0.05, 1.2), min_size=2, max_size=4))
def test_no_path_wins_energy_from_softening(peaks: list[float]) -> None:
    trace = cycled(soft(), peaks, per_second=1500, tolerance=1e-8)
    work = work_of(trace)
    assert np.min(work) > -1e-6 * np.max(work)
    ends = work[::1500]
    assert np.all(np.diff(ends) > -1e-5 * np.max(work)), "no closed cycle gives energy back"


def test_softening_asks_for_laws_that_say_their_energy() -> None:
    with pytest.raises(ArrangementError, match=r"Softening member 'spring'.*LinearElastic"):
        StressSoftening(
            members=(("spring", LinearElastic(modulus=1e6)),), curve=OgdenRoxburgh(strength=2.0, scale=1e5)
        )
    with pytest.raises(ValueRangeError, match="strength"):
        StressSoftening(
            members=(("law", NeoHooke(shear_modulus=1e6)),), curve=OgdenRoxburgh(strength=0.8, scale=1e5)
        )


# --- permanent set --------------------------------------------------------------------------------


def test_after_a_pull_the_rest_length_has_grown_by_its_share() -> None:
    share, modulus = 0.1, 1e6
    law = PermanentSet(
        members=(("law", LinearElastic(modulus=modulus)),), share=share, memory=Rising(width=1e-4)
    )
    trace = cycled(law, [0.5, 0.3])
    strain, force = trace["rubber.strain"], trace["rubber.force"] / AREA
    greatest = np.maximum.accumulate(strain)
    # The greatest strain lags by ten widths of 1e-4 at most.
    assert np.max(np.abs(force - modulus * (strain - share * greatest))) < share * 1e-3 * modulus
    unloading = (trace.time > 0.6) & (trace.time < 1.0)
    at_zero = np.interp(0.0, force[unloading][::-1], strain[unloading][::-1])
    assert at_zero == pytest.approx(share * 0.5, rel=0.005)


def test_work_on_a_set_is_stored_or_lost_while_it_grows() -> None:
    """First loading of Hooke: W = ½E(1 − c)²ε² + E·(1 − c)·c·ε²/2; afterwards nothing is lost."""
    share, modulus = 0.2, 1e6
    trace = cycled(
        PermanentSet(
            members=(("law", LinearElastic(modulus=modulus)),), share=share, memory=Rising(width=1e-4)
        ),
        [0.5, 0.5],
    )
    work = work_of(trace) / VOLUME
    stored = modulus / 2 * ((1 - share) * 0.5) ** 2
    lost = modulus * (1 - share) * share * 0.5**2 / 2
    assert work[2000] == pytest.approx(stored + lost, rel=2e-3)
    back = modulus / 2 * (share * 0.5) ** 2
    assert work[4000] == pytest.approx(lost + back, rel=3e-3), "at zero strain it is compressed by the set"
    # At the second peak the rounded switch lets the state make up for its lag of w·ln(ε/w).
    lag = 1e-4 * math.log(0.5 / 1e-4)
    assert 0.0 <= work[8000] - work[4000] < 1.05 * share * modulus * (1 - share) * 0.5 * lag


def test_laws_inside_a_set_see_the_rate_of_what_is_left() -> None:
    """A dashpot: η·(1 − c)·ε̇ while the set grows, η·ε̇ on the way back."""
    law = PermanentSet(
        members=(("oil", ViscousMaterial(viscosity=2e4)),), share=0.3, memory=Rising(width=1e-4)
    )
    trace = cycled(law, [0.5])
    stress, rate = trace["rubber.force"] / AREA, trace["grip.speed"] / LENGTH
    growing = (trace.time > 0.15) & (trace.time < 0.45)
    assert stress[growing] == pytest.approx(0.7 * 2e4 * rate[growing], rel=2e-3)
    back = (trace.time > 0.55) & (trace.time < 0.95)
    assert stress[back] == pytest.approx(2e4 * rate[back], rel=1e-9)


@settings(max_examples=settings.default.max_examples // 10, deadline=None)
@given(st.lists(st.floats(0.05, 1.0), min_size=2, max_size=4), st.floats(0.0, 0.5))
def test_no_path_wins_energy_from_a_set_around_fading_memory(peaks: list[float], share: float) -> None:
    inside = parallel(still=LinearElastic(modulus=1e6), branch=maxwell(modulus=0.8e6, viscosity=5e4))
    law = PermanentSet(members=(("law", inside),), share=share, memory=Rising(width=1e-4))
    work = work_of(cycled(law, peaks, per_second=1500, tolerance=1e-8))
    assert np.min(work) > -1e-5 * np.max(work)


# --- self-heating ---------------------------------------------------------------------------------

CAPACITY, COOLING, AMBIENT = 2e6, 4e4, 293.15
STILL, BRANCH, ETA = 1e6, 0.8e6, 2e4


def hot(softening: float, cooling: float = COOLING, capacity: float = CAPACITY) -> SelfHeating:
    inside = parallel(still=LinearElastic(modulus=STILL), branch=maxwell(modulus=BRANCH, viscosity=ETA))
    return SelfHeating(
        members=(("law", inside),),
        heat=HeatBalance(
            heat_capacity=capacity, cooling=cooling, softening=softening, ambient=AMBIENT
        ),
    )  # fmt: skip


def shaken(law: Element, seconds: float, per_second: int = 500, frequency: float = 4.0) -> Trace:
    times = np.linspace(0.0, seconds, int(seconds * per_second) + 1)
    w = 2 * math.pi * frequency
    return run(
        pulled(law=law), times, lambda t: 0.3 * math.sin(w * t), lambda t: 0.3 * w * math.cos(w * t), 1e-10
    )


@pytest.mark.parametrize(("softening", "highest"), [(0.02, 25.0), (0.0, math.inf), (-1 / 293.15, math.inf)])
def test_the_range_of_the_warming_is_noted_on_the_state(softening: float, highest: float) -> None:
    """Valid while T' < 1/(2·b); a law that stiffens has no limit."""
    model = pulled(law=hot(softening))
    warming = next(v for v in model.states if v.name == "rubber.law.warming")
    assert (warming.minimum, warming.maximum) == (-math.inf, pytest.approx(highest))


@pytest.mark.parametrize("softening", [0.0, 0.02, -1 / 293.15])
def test_the_first_law_holds_at_every_moment(softening: float) -> None:
    """Work = C·T' + (1 + b·T₀)·(elastic energy at T₀) + heat given off; the capacity is small."""
    trace = shaken(hot(softening, capacity=5e3), 1.0, per_second=8000)
    work = work_of(trace) / VOLUME
    warming = trace["rubber.law.warming"]
    strain, flow = trace["rubber.strain"], trace["rubber.law.law.branch.dashpot.strain"]
    elastic = STILL / 2 * strain**2 + BRANCH / 2 * (strain - flow) ** 2
    off = cumulative_simpson(COOLING * warming, x=trace.time, initial=0.0)
    balance = work - 5e3 * warming - (1 + softening * AMBIENT) * elastic - off
    assert np.max(np.abs(balance)) < 1e-6 * np.max(np.abs(work))
    assert np.max(warming) > 5.0, "there is something to balance"
    assert softening == 0.0 or np.ptp(1 - softening * warming) > 0.02


def test_the_steady_rise_is_the_loss_of_a_cycle_over_the_cooling() -> None:
    """b = 0: h·T' = ω/2·E''·ε² with E'' of the standard linear solid."""
    law = hot(0.0, cooling=1e6, capacity=1e5)
    trace = shaken(law, 2.0, per_second=2000)
    w = 2 * math.pi * 4.0
    loss_modulus = (BRANCH * 1j * w * ETA / (BRANCH + 1j * w * ETA)).imag
    mean = float(np.mean(trace["rubber.law.warming"][-1001:-1]))
    assert mean == pytest.approx(w / 2 * loss_modulus * 0.3**2 / 1e6, rel=1e-3)
    power = float(np.mean(trace["rubber.law.lost_power"][-1001:-1]))
    assert power == pytest.approx(w / 2 * loss_modulus * 0.3**2, rel=1e-4)


def test_the_heat_of_a_springpot_is_that_of_its_loss_modulus() -> None:
    """Mean power ω/2·E''·ε² with E'' = |E*|·sin(α·π/2) of the exact law, to the error of the series."""
    pot = Springpot(modulus=1e6, reference=4.0, order=0.15, lower=0.1, upper=100.0)
    law = SelfHeating(
        members=(("pot", pot),),
        heat=HeatBalance(heat_capacity=1e6, cooling=0.0, softening=0.0, ambient=AMBIENT),
    )
    trace = shaken(law, 3.0)
    power = float(np.mean(trace["rubber.law.lost_power"][-1001:-1]))
    loss_modulus = 1e6 * math.sin(0.15 * math.pi / 2)
    assert power == pytest.approx(math.pi * 4.0 * loss_modulus * 0.3**2, rel=0.03)
    assert pot.largest_error / math.sin(0.15 * math.pi / 2) < 0.03, "error of the modulus over its lossy part"


def test_a_warm_piece_pulls_less_and_beyond_half_its_modulus_the_result_says_so() -> None:
    trace = shaken(hot(0.03, cooling=0.0, capacity=2e4), 1.0)
    warming = trace["rubber.law.warming"]
    inner = trace["rubber.law.law.stress"]
    assert trace["rubber.law.stress"] == pytest.approx((1 - 0.03 * warming) * inner, rel=1e-12, abs=1e-9)
    (found,) = trace.warnings
    assert found.name == "rubber.law.warming"
    assert found.maximum == pytest.approx(0.5 / 0.03)


@pytest.mark.slow
def test_heat_comes_from_fillers_dashpots_and_softening_alike() -> None:
    """A closed cycle at b = 0 without cooling: C·T' is the work that did not come back."""
    inside: dict[str, Element] = {
        "fillers": SlidingFillers(modulus=1e6, yield_stress=5e4),
        "mullins": soft(0.1),
        "set": PermanentSet(
            members=(("law", NeoHooke(shear_modulus=3e5)),), share=0.1, memory=Rising(width=1e-4)
        ),
        "branch": maxwell(modulus=BRANCH, viscosity=ETA),
        "dashpot": ViscousMaterial(viscosity=2e3),
    }
    for name, law in inside.items():
        wrapped = SelfHeating(
            members=((name, law),),
            heat=HeatBalance(heat_capacity=1e5, cooling=0.0, softening=0.0, ambient=AMBIENT),
        )
        trace = cycled(wrapped, [0.5])
        work = work_of(trace)[-1] / VOLUME
        left = stored_at_the_end(name, trace)
        warmed = 1e5 * trace["rubber.law.warming"][-1]
        assert warmed == pytest.approx(work - left, rel=2e-5), name
        assert warmed > 1e2, name


def stored_at_the_end(name: str, trace: Trace) -> float:
    """Elastic energy per volume that a law still holds at zero strain after its cycle."""
    if name == "fillers":
        sliders = [trace[f"rubber.law.fillers.slider_{i}"][-1] for i in (1, 2, 3, 4)]
        return sum(z**2 for z in sliders) / (2 * 1e6 / 4)
    if name == "branch":
        return BRANCH / 2 * float(trace["rubber.law.branch.spring.strain"][-1]) ** 2
    if name == "set":
        stretch = 1 + float(trace["rubber.law.set.law.strain"][-1])
        return 3e5 / 2 * (stretch**2 + 2 / stretch - 3)
    return 0.0


def test_laws_of_energy_belong_inside_a_specimen() -> None:
    spring = (("spring", Spring(stiffness=100.0)),)
    balance = HeatBalance(heat_capacity=1.8e6, cooling=4e4, softening=3e-3)
    with pytest.raises(
        ArrangementError, match="HeatBalance: acts on strain and stress -> put it inside a spec"
    ):
        SelfHeating(members=spring, heat=balance)
    with pytest.raises(ArrangementError, match="OgdenRoxburgh: acts on strain and stress -> put it inside"):
        StressSoftening(members=spring, curve=OgdenRoxburgh(strength=1.8, scale=1e5))


def test_a_set_is_one_law_with_or_without_section_and_length() -> None:
    """A spring of k = E·A/L that sets, and a piece whose law does: the same force along the same motion."""
    inside = (("law", LinearElastic(modulus=1e6)),)
    law = PermanentSet(members=inside, share=0.1, memory=Rising(width=1e-4))
    whole = PermanentSet(
        members=(("law", Spring(stiffness=1e6 * AREA / LENGTH)),),
        share=0.1,
        memory=Rising(width=1e-4 * LENGTH),
    )
    forces = [
        simulate(
            flatten(assembly("pulled", grip=Driven(domain=TRANSLATION), piece=tie(piece, "grip"))),
            np.linspace(0.0, 2.0, 41),
            inputs={
                "grip.position": lambda t: 0.5 * LENGTH * np.sin(np.pi * t / 2) ** 2,
                "grip.speed": lambda t: 0.25 * np.pi * LENGTH * np.sin(np.pi * t),
            },
            tolerance=1e-10,
        )["piece.force"]
        for piece in (specimen(area=AREA, rest_length=LENGTH, law=law), whole)
    ]
    assert forces[0] == pytest.approx(forces[1], rel=1e-7, abs=1e-7)
    assert forces[0][-1] < -0.04 * 1e6 * AREA
