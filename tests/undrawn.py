"""Figures that are made, with all their lines, words and sizes, but not drawn.

For tests of which drawings are not the point; ``tests/unit/presentation/test_figures.py`` draws each kind.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from matplotlib.figure import Figure

from nlsdesign.presentation.figures import svg


def blank(figure: Figure) -> str:
    """Return an empty drawing of the size of a figure."""
    width, height = 72.0 * figure.get_size_inches()
    size = f'width="{width}pt" height="{height}pt" viewBox="0 0 {width} {height}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}/>'


@contextmanager
def without_drawing() -> Iterator[None]:
    """Leave every figure blank."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(svg, "_svg_on_nothing", blank)
        patch.setattr(svg, "_content", lambda figure, suffix: blank(figure).encode())
        yield


@pytest.fixture(scope="module")
def undrawn() -> Iterator[None]:
    """No figure of the tests of a module is drawn."""
    with without_drawing():
        yield
