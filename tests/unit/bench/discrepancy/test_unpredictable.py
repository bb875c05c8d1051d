"""A record that free flight makes unpredictable counts as the others do, and only the quickest may."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from nlsdesign.bench.discrepancy.fitting import Key, Tally, diverges, like_the_others, quickest, unpredictable
from nlsdesign.bench.identification import Parameter
from nlsdesign.bench.identification.equation_error.block import Drive
from nlsdesign.bench.identification.equation_error.evidence import Evidence
from nlsdesign.bench.identification.least_squares import Fit
from nlsdesign.foundation.errors import ConvergenceError

ROWS = {("spring", r): 100 for r in ("slow", "middle", "quick")} | {("motor", "quick"): 50}


def tallies(**squares: float) -> dict[Key, Tally]:
    return {key: Tally(squares[key[1] if key[0] == "spring" else key[0]], n, n) for key, n in ROWS.items()}


BEFORE = tallies(slow=500.0, middle=500.0, quick=500.0, motor=900.0)


def after(**changes: float) -> dict[Key, Tally]:
    return tallies(**{"slow": 110.0, "middle": 130.0, "quick": 120.0, "motor": 60.0, **changes})


def test_where_all_records_are_predicted_none_is_set_aside() -> None:
    assert unpredictable(BEFORE, after(), {"quick"}) == frozenset()


def test_a_quick_record_predicted_worse_than_before_is_set_aside() -> None:
    assert unpredictable(BEFORE, after(quick=5000.0), {"quick"}) == {("spring", "quick")}


def test_a_quick_record_left_far_behind_the_others_is_set_aside() -> None:
    assert unpredictable(BEFORE, after(quick=270.0), {"quick"}) == {("spring", "quick")}
    assert unpredictable(BEFORE, after(quick=250.0), {"quick"}) == frozenset()


def test_a_slow_record_is_never_set_aside() -> None:
    assert unpredictable(BEFORE, after(slow=5000.0), {"quick"}) == frozenset()


def test_a_record_set_aside_counts_as_the_others_of_its_block_and_never_for_more() -> None:
    before, key = after(quick=5000.0), ("spring", "quick")
    counted = like_the_others(before, {key})
    assert counted[key] == Tally((110.0 + 130.0) / 200 * 100, 100, 100)
    assert {k: t for k, t in counted.items() if k != key} == {k: t for k, t in before.items() if k != key}
    assert like_the_others(after(quick=50.0), {key})[key].squares == 50.0
    pieces = {**before, key: before[key]._replace(segments=(4000.0, 2000.0))}
    assert like_the_others(pieces, {key})[key].segments == pytest.approx((96.0, 48.0))


@dataclass
class Motion:
    """A record of one angle, q = a·sin(ω·t)."""

    name: str
    rate: float
    step: float = 0.001
    trace: dict[str, np.ndarray] = field(init=False)

    def __post_init__(self) -> None:
        self.trace = {"q": np.sin(self.rate * self.step * np.arange(1000))}


def seen(motion: Motion, order: int) -> Evidence:
    block = SimpleNamespace(drives={"q": Drive("q", order)})
    return cast(Evidence, SimpleNamespace(driven=SimpleNamespace(block=block), record=motion))


def test_the_quickest_quarter_is_that_of_the_largest_accelerations() -> None:
    motions = [Motion(f"r{k}", rate) for k, rate in enumerate((3.0, 40.0, 7.0, 1.0, 30.0, 2.0, 5.0, 4.0))]
    assert quickest([seen(m, 1) for m in motions]) == {"r1", "r4"}
    assert quickest([seen(m, 1) for m in motions[:7]]) == {"r1"}
    assert quickest([seen(m, 1) for m in motions[:3]]) == frozenset(), "of three none can be spared"
    assert quickest([seen(m, 0) for m in motions]) == frozenset(), "only a motion whose rate drives counts"


# --- proof ----------------------------------------------------------------------------------------


def seen_by(response: Callable[[float], np.ndarray]) -> Evidence:
    """A record whose residual is a function of one number."""

    def residual(values: Mapping[str, float]) -> tuple[np.ndarray, None]:
        return response(values["gap"]), None

    return cast(Evidence, SimpleNamespace(residual=residual))


GAP = Parameter("gap", "rad", 0.05, 0.05, math.inf, 1e-3, 1.0, "log")
KNOWN = Fit((GAP,), {"gap": 0.05}, np.array([[0.003**2]]), 1.0, {}, True)
TIME = np.linspace(0.0, 1.0, 400)


def test_a_record_is_proved_unpredictable_by_neighbours_that_go_another_way() -> None:
    """The course x' = 3.99·x·(1 - x) doubles a difference at each of its 50 steps."""

    def course(gap: float) -> np.ndarray:
        x = [0.3 + 0.1 * gap]
        for _ in range(50):
            x.append(3.99 * x[-1] * (1.0 - x[-1]))
        return np.array(x) - 0.5

    assert diverges(seen_by(course), KNOWN)


def test_a_record_that_a_wrong_law_fails_on_is_not_unpredictable() -> None:
    """A resonance that the law does not know: large, and the same for all neighbours."""
    assert not diverges(seen_by(lambda gap: 50.0 * np.sin(40.0 * TIME) + gap * TIME), KNOWN)


def test_neighbours_without_a_response_diverge() -> None:
    def response(gap: float) -> np.ndarray:
        if gap != 0.05:
            raise ConvergenceError("block", "has no response")
        return TIME

    assert diverges(seen_by(response), KNOWN)
