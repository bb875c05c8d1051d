"""The table of independent roads: for each component two ways to the same number, and the law between them."""

from __future__ import annotations

from typing import NamedTuple

from nlsdesign.components import Part


class Row(NamedTuple):
    """What proves the physics of one component.

    ``test`` is ``file.py::test_name`` in this folder; an earlier row may carry the same test.
    """

    component: type[Part]
    law: str
    roads: tuple[str, str]
    test: str
