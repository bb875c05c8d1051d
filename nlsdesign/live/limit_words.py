"""Limits in the words of the page, for sentences of other rooms too, which name them by their classes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from ..design.optimisation.limits import limit_kinds
from ..design.parametric.cam_question import LimitNumber
from .answers import LimitMargin
from .question import LiveQuestion

_OTHERS = {
    "MaximumTorqueError": "torque error that is allowed",
    "NumberRange": "range of a free number",
    "RestLengthRange": "its rest length",
}
"""Classes of limits that the page has no slider for."""
_NO_LIMITS: Mapping[str, LimitNumber] = {}


def in_words(sentence: str, limits: Mapping[str, LimitNumber] = _NO_LIMITS) -> str:
    """Return a sentence with each limit called what it limits, with its number where it has one."""
    kinds = limit_kinds()
    names = "|".join([*kinds, *_OTHERS])

    def read(match: re.Match[str]) -> str:
        name = match.group()
        if name not in kinds:
            return _OTHERS[name]
        kind = kinds[name]
        return f"{kind.title} ({kind.shown(limits[name].value)})" if name in limits else kind.title

    # "MaximumStress: stress of rubber <= 2 MPa" says already what it limits.
    stated = (
        re.sub(rf"\b(?:{names}): (?=[^;,:]* [<>]= )", "", sentence)
        .replace(" <= ", " ≤ ")
        .replace(" >= ", " ≥ ")
    )
    return re.sub(rf"\b(?:{names})\b", read, stated)


def shown_bound(margin: LimitMargin) -> str:
    """Return a side of a limit in words: what it bounds, the side, the number with its unit."""
    return f"{margin.of} {'≤' if margin.upper else '≥'} {shown_value(margin, margin.bound)}"


def shown_value(margin: LimitMargin, value: float) -> str:
    """Return a number of a limit in the unit in which people read it."""
    return limit_kinds()[margin.limit].shown(value) if margin.limit in limit_kinds() else margin.shown(value)


def holding(question: LiveQuestion, margins: Iterable[LimitMargin]) -> list[str]:
    """Return what a design sits on in words, without limits that are shown and not kept."""
    words = [shown_bound(each) for each in margins if each.active and question.keeps(each.limit)]
    if question.contour not in question.free:
        words.append("the contour, which is held")
    return words
