"""The figure of torque errors over the spread: every number of its alternative text, by hand."""

from __future__ import annotations

import numpy as np

from nlsdesign.feedback.observer import SpreadErrors
from nlsdesign.presentation.figures import errors_over_spread
from nlsdesign.presentation.figures.style import alternative_text

DRAWN = np.array([[[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]], [[7.0, 7.0], [7.0, 7.0], [7.0, 7.0]]]) * 1e-3


def errors(bound: np.ndarray) -> SpreadErrors:
    causes = {"spring.rubber.area": np.array([[3e-3, 3e-3], [9e-3, 9e-3]]), "counts": np.ones((2, 2)) * 1e-3}
    return SpreadErrors(
        ("best", "other"), (2.0, 5.0), "N*m", 2.8, np.array([[0.5, 0.5], [6.0, 8.0]]) * 1e-3, DRAWN, causes,
        bound, 0,
    )  # fmt: skip


def test_the_text_says_what_is_drawn() -> None:
    figure = errors_over_spread(errors(np.array([2.5e-3, 2.5e-3])))
    text = alternative_text(figure)
    # Of 1, 3, 5 the median is 3 and the 90 % quantile 4.6; of 2, 4, 6: 4 and 5.6.
    assert "best: median 3.00 to 4.00, 90 % 4.60 to 5.60, with exact numbers 0.500 mN·m." in text
    assert "other: median 7.00, 90 % 7.00, with exact numbers 6.00 to 8.00 mN·m." in text
    assert "Bound on the rms of any estimator 2.50 mN·m" in text
    left, right = figure.axes
    assert left.get_ylabel() == "torque error in mN·m rms"
    assert [label.get_text() for label in right.get_yticklabels()] == ["rubber.area", "counts"]
    first = right.lines[0].get_xdata()
    np.testing.assert_allclose(first, [3.0, 1.0])


def test_without_a_bound_none_is_drawn() -> None:
    assert "Bound" not in alternative_text(errors_over_spread(errors(np.zeros(0))))
