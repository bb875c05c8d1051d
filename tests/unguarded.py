"""A sampled model without what its guards know, for tests of the equations alone."""

from __future__ import annotations

from dataclasses import replace

from nlsdesign.model import FlatModel


def unguarded(model: FlatModel) -> FlatModel:
    """Return a model that begins at its start values and takes any finite input."""
    inputs = tuple(
        replace(v, plausibility=None, minimum=-float("inf"), maximum=float("inf")) for v in model.inputs
    )
    return replace(model, inputs=inputs, begin=None, expected=None)
