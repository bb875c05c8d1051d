"""Refusal of models with discontinuous equations: generated code does not locate events."""

from __future__ import annotations

from ...foundation.errors import ExportError
from ...model import FlatModel


def refuse_jumps(model: FlatModel) -> None:
    """Raise if the equations of a model are discontinuous, for instance with stiction.

    Parameters
    ----------
    model
        Any model.

    Raises
    ------
    ExportError
        Naming the element.
    """
    if model.switching is not None and model.switching.jumps:
        raise ExportError(
            f"model '{model.name}': '{model.switching.jumps[0]}'",
            "is not smooth, and an integrator with fixed steps does not locate sticking and impacts",
            next_step="export the smooth form: flatten(smoothed(assembly))",
        )
