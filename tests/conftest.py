"""Fixtures and settings shared by all rooms of tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# Before anything imports matplotlib: no test opens a window.
os.environ["MPLBACKEND"] = "Agg"
# Two exports of one test are the same bytes, on either side of a full minute.
os.environ["SOURCE_DATE_EPOCH"] = "1760000000"

# The same examples in every run; no time limit (it would test the machine); nothing written to disk.
settings.register_profile("nlsdesign", derandomize=True, deadline=None, database=None)
settings.load_profile("nlsdesign")


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
