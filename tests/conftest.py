"""Fixtures and settings shared by all rooms of tests."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from nlsdesign.foundation import symbolic

# What is imported and collected stays: there is no garbage until the first test runs.
gc.disable()

# Before anything imports matplotlib: no test opens a window.
os.environ["MPLBACKEND"] = "Agg"
# Two exports of one test are the same bytes, on either side of a full minute.
os.environ["SOURCE_DATE_EPOCH"] = "1760000000"
# FMUs and steps of controllers compile in a fifth of the time; those of users run in test_fmu_agreement.
os.environ["NLSDESIGN_CFLAGS"] = "-O0"

# Files of tests ask in turn for the same few machines, observers and loops: more are kept than elsewhere.
# Before anything imports a room whose functions remember.
_remembered = symbolic.remembered
symbolic.remembered = lambda count: _remembered(8 * count)  # type: ignore[misc]

# The same examples in every run; no time limit (it would test the machine); nothing written to disk.
settings.register_profile("thorough", derandomize=True, deadline=None, database=None, max_examples=300)
settings.register_profile("quick", settings.get_profile("thorough"), max_examples=12)


def pytest_configure(config: pytest.Config) -> None:
    """The run without the slow tests also draws fewer examples."""
    settings.load_profile("quick" if config.option.markexpr == "not slow" else "thorough")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark as slow the cases that a test names in its mark ``long_cases``; each must be one of its cases."""
    unseen: dict[str, set[str]] = {}
    for item in items:
        mark = item.get_closest_marker("long_cases")
        if mark is None:
            continue
        test, _, case = item.nodeid.partition("[")
        unseen.setdefault(test, set(mark.args)).discard(case.removesuffix("]"))
        if case.removesuffix("]") in mark.args:
            item.add_marker(pytest.mark.slow)
    wrong = {test: cases for test, cases in unseen.items() if cases}
    if wrong and not config.option.lf and not any("::" in argument for argument in config.args):
        raise pytest.UsageError(f"no such cases, see the mark long_cases: {wrong}")


def pytest_collection_finish() -> None:
    """What was collected stays until the end; garbage is looked for after 300,000 new objects, not 700."""
    gc.collect()
    gc.freeze()
    gc.enable()
    gc.set_threshold(300_000, 20, 50)


@pytest.fixture(autouse=True, scope="session")
def in_this_process() -> Iterator[None]:
    """Work that is shared stays here unless a test says otherwise: pytest's own workers have the cores.

    A process of pytest is large, so that a copy of it costs more than a short piece of work.
    """
    from nlsdesign.foundation.work_sharing import Processes, spread_over

    with spread_over(Processes(1)):
        yield


@pytest.fixture(scope="session")
def root() -> Path:
    """Folder of the checkout."""
    return Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared_folder() -> Path:
    """Folder with figures and measurements that are not part of the project."""
    name = os.environ.get("NLSDESIGN_SHARED")
    if not name:
        pytest.skip("compares with data outside the project: NLSDESIGN_SHARED does not name its folder")
    folder = Path(name)
    assert folder.is_dir(), f"NLSDESIGN_SHARED={name} is not a folder"
    return folder
