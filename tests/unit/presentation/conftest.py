"""What tests of pages in a browser share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.browser import Tab, browser


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    with browser() as one:
        yield one
