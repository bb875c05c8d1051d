"""Answers as the page takes them: seven digits, no more points than a screen shows, nothing unseen."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import NlsError
from .answers import AngleAnswer, DesignView, LiveAnswer, Mechanism, to_json
from .at_angle import AngleView
from .limit_words import in_words

_DIGITS = 7
_MOST_POINTS = 140
"""Of a line in the picture of the mechanism."""


def answer_data(answer: LiveAnswer) -> dict[str, Any]:
    """Return an answer as plain data."""
    data: dict[str, Any] = to_json(dataclasses.replace(answer, design=None))
    return {**data, "design": design_data(answer.design), "stale": answer.stale}


def design_data(design: DesignView | None) -> dict[str, Any] | None:
    """Return a design as plain data, without the contour, which the mechanism shows.

    ``design``: what is shown; none before the first.
    """
    if design is None:
        return None
    columns = [
        {"name": each.name, "unit": each.unit, "values": short_numbers(each.values)}
        for each in design.columns
    ]
    data: dict[str, Any] = to_json(dataclasses.replace(design, columns=(), contour=np.zeros((0, 2))))
    return {**data, "columns": columns}


def angle_data(answer: AngleAnswer) -> dict[str, Any]:
    """Return what holds at an angle as plain data, without the mechanism, which is sent before."""
    return {
        "angle": answer.angle,
        "observability": to_json(answer.observability),
        "poles": to_json(answer.poles),
        "loop": to_json(answer.loop),
    }


def mechanism_data(shown: AngleView | None, angle: float | None) -> dict[str, Any]:
    """Return the mechanism at an angle, or why there is no picture of it.

    ``shown``: design; none before the first.
    """
    if shown is None or angle is None:
        return {"angle": angle, "mechanism": None, "reason": "there is no design yet"}
    try:
        mechanism = shown.mechanism(angle)
    except NlsError as error:
        # A contour of no radius has no outline; its torque is an answer all the same.
        return {"angle": angle, "mechanism": None, "reason": in_words(str(error))}
    return {"angle": angle, "mechanism": _lines(mechanism), "reason": ""}


def short_numbers(values: Array) -> list[Any]:
    """Return numbers with seven digits; those that are not finite are ``None``."""
    finite = np.isfinite(values)
    kept = np.where(finite, values, 0.0)
    size = np.where(kept == 0.0, 1.0, np.abs(kept))
    # Division by a power of ten, not multiplication by its inverse, which is no decimal number.
    scale = 10.0 ** np.clip(_DIGITS - 1.0 - np.floor(np.log10(size)), -300.0, 300.0)
    rounded = np.round(kept * scale) / scale
    if bool(finite.all()):
        return list(rounded.tolist())
    shown = rounded.astype(object)
    shown[~finite] = None
    return list(shown.tolist())


def _lines(mechanism: Mechanism) -> dict[str, Any]:
    lines = {
        name: [short_numbers(_fewer(each)) for each in getattr(mechanism, name)]
        for name in ("halves", "cables", "contacts", "guides", "rubbers")
    }
    extent = short_numbers(np.array(mechanism.extent))
    return {"angle": mechanism.angle, **lines, "extent": extent, "remark": mechanism.remark}


def _fewer(points: Array) -> Array:
    """Return a line with fewer points; its ends, and every corner of a short one, stay."""
    if points.ndim < 2 or len(points) <= _MOST_POINTS:
        return points
    kept = np.unique(np.round(np.linspace(0, len(points) - 1, _MOST_POINTS)).astype(int))
    fewer: Array = points[kept]
    return fewer
