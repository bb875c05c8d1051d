"""Work for workers that need not load the package's rooms for it."""

from __future__ import annotations

import time


def square(number: int) -> int:
    """The square of a number, after a hundredth of a second."""
    time.sleep(0.01)
    if number == 55:
        raise ValueError("no")
    return number * number
