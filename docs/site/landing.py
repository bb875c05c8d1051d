"""The picture of the first page: what the code draws that stands above it."""

from __future__ import annotations

import re
from typing import Any

from . import markup

_PLACE = "<!-- picture -->"
_CODE = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def with_picture(page: str) -> str:
    """Return the first page with the figure that its code draws, as SVG.

    Parameters
    ----------
    page
        Markdown; its one block of Python leaves a ``figure``.
    """
    (code,) = _CODE.findall(page)
    drawn: dict[str, Any] = {}
    exec(code, drawn)
    svg = markup.drawings(drawn["figure"], "reference")
    words = "The cam of the reference actuator at two angles, with its cable and the rubber behind it."
    return page.replace(_PLACE, markup.plot(svg, words))
