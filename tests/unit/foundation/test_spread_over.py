"""Maps within one computation go over any executor, with the results of this machine."""

from __future__ import annotations

import os
import pickle
import signal
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.design import ExponentialTorque, PowerTorque, design_cam
from nlsdesign.design.tolerance.monte_carlo import tolerance_analysis
from nlsdesign.design.tolerance.tolerance_result import ToleranceResult
from nlsdesign.foundation.deck import load_deck
from nlsdesign.foundation.errors import UnitError, WorkSharingError
from nlsdesign.foundation.work_sharing import (
    DaskScheduler,
    Executor,
    InThisProcess,
    Processes,
    parallel_map,
    spread_over,
)
from nlsdesign.foundation.work_sharing.chunks import sendable
from nlsdesign.foundation.work_sharing.shared_map import _Caller
from nlsdesign.sweeps.questions import QUICK

BOTH = [InThisProcess(), Processes(2)]
CURVE = PowerTorque(coefficient=4.35, exponent=2.09, angle=0.87)


def places(executor: Executor, count: int) -> set[int]:
    """Return the processes in which a map was computed."""
    with spread_over(executor):
        return set(parallel_map(lambda _: os.getpid(), count))


@pytest.mark.parametrize("executor", BOTH)
def test_results_come_in_order_and_an_exception_keeps_its_kind(executor: Executor) -> None:
    with spread_over(executor):
        assert list(parallel_map(lambda k: k * k, 50)) == [k * k for k in range(50)]
        assert list(parallel_map(lambda k: k, 0)) == []
        got: list[int] = []
        with pytest.raises(UnitError, match=r"length: 'kg' is no length") as error:
            got.extend(parallel_map(refused_at_three, 9))
        assert got == [0, 1, 2]
        assert error.value.next_step == "write m"


def refused_at_three(number: int) -> int:
    if number == 3:
        raise UnitError("length", "'kg' is no length", next_step="write m")
    return number


def test_the_block_says_where_and_nothing_else_does() -> None:
    assert places(InThisProcess(), 4) == {os.getpid()}
    assert os.getpid() not in places(Processes(2), 4)
    with spread_over(Processes(2)):
        assert places(InThisProcess(), 4) == {os.getpid()}, "the inner block holds"
        # A map within a map is done by the worker that has the outer one.
        pairs = list(parallel_map(lambda _: (os.getpid(), list(parallel_map(lambda _: os.getpid(), 2))), 2))
    assert all(inner == [outer, outer] for outer, inner in pairs)


def test_work_that_ends_its_workers_is_an_error_and_not_a_missing_result() -> None:
    with spread_over(Processes(2)), pytest.raises(WorkSharingError, match="part 2 of the work: came to no"):
        list(parallel_map(lambda k: os.kill(os.getpid(), signal.SIGKILL) if k == 1 else k, 3))


def test_a_map_goes_on_where_one_of_its_workers_is_killed(tmp_path: Path) -> None:
    def killed_once(number: int) -> int:
        mark = tmp_path / "killed"
        if number == 1 and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return number

    with spread_over(Processes(2)):
        assert list(parallel_map(killed_once, 4)) == [0, 1, 2, 3]


def content(result: ToleranceResult) -> dict[str, Any]:
    """Return every number of an analysis, to the bit."""
    return {
        "errors": result.errors.tobytes(),
        "band": result.band.tobytes(),
        "causes": [pickle.dumps(each) for each in result.causes],
        "trims": [(each.name, each.errors.tobytes(), each.settings.tobytes()) for each in result.trims],
    }


def analysed(draws: int) -> dict[str, Any]:
    actuator = declare(load_deck("austin2015_figure_consistent"))
    return content(tolerance_analysis(actuator, target=CURVE, draws=draws, seed=3))


@pytest.mark.slow
def test_a_tolerance_analysis_has_the_same_bits_wherever_its_causes_are_computed() -> None:
    expected = analysed(20)
    for executor in BOTH:
        with spread_over(executor):
            assert analysed(20) == expected


@pytest.fixture
def cluster() -> Iterator[DaskScheduler]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as running:
        yield DaskScheduler(running.scheduler_address)


def test_work_that_cannot_be_sent_says_what_else_there_is() -> None:
    lock = threading.Lock()
    work = _Caller(lambda _: lock)
    with pytest.raises(WorkSharingError, match=r"cannot be sent to workers: .*lock.* -> spread it over Proc"):
        sendable(work)


@pytest.mark.slow
def test_a_dask_scheduler_computes_the_same_tolerances_and_designs(cluster: DaskScheduler) -> None:
    actuator = declare(load_deck("austin2015_figure_consistent"))
    target = ExponentialTorque(maximum=2.0, angle=0.9, shape=1.0)
    free = ("spring.cam.contour", "spring.pretension")
    seen = []

    def designed() -> tuple[str, float]:
        made = design_cam(actuator, target=target, free=free, settings=QUICK)
        return deck_text(made.actuator), made.rms

    expected = analysed(200), designed()
    with spread_over(cluster):
        seen += list(parallel_map(lambda _: os.getpid(), 20))
        got = analysed(200), designed()
    assert os.getpid() not in seen
    assert got == expected
