"""Which cases of a long table the quick run keeps."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def quick_only(cases: Iterable[Any], kept: Collection[Any]) -> list[Any]:
    """Return the cases, those that are not kept marked as slow."""
    cases = list(cases)
    assert set(kept) <= set(cases), "a case that is kept does not exist"
    return [case if case in kept else _slow(case) for case in cases]


def _slow(case: Any) -> Any:
    # A tuple is one case of several arguments.
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.slow)
