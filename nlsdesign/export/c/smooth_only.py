"""Models whose equations jump are not written as code: nothing there would find the moment."""

from __future__ import annotations

from ...errors import ExportError
from ...model import FlatModel


def refuse_jumps(model: FlatModel) -> None:
    """Raise if the equations of a model jump, as with friction that sticks.

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
            "is not smooth, and an integrator with fixed steps would not find where it sticks or strikes",
            next_step="export the smooth form: flatten(smoothed(assembly))",
        )
