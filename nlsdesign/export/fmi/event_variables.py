"""What an FMU shows of the switches of a model: the mode of each, and an event indicator."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...model.flat import FlatModel, Variable
from ...model.switching import Switch


def located_switches(model: FlatModel) -> tuple[Switch, ...]:
    """Return the switches whose changes an importer has to locate.

    A model with corners only has none: an integrator gets across them, at the cost of shorter steps.
    """
    return model.switching.switches if model.switching is not None and model.switching.jumps else ()


def indicator_variables(model: FlatModel) -> list[Variable]:
    """Return an event indicator for each located switch."""
    names = _names(located_switches(model))
    return [
        Variable(f"{name}.indicator", "1", f"Not negative as long as the mode of {name} lasts, in SI units")
        for name in names
    ]


def mode_variables(model: FlatModel) -> list[Variable]:
    """Return the mode of each located switch: −1, 0 or 1."""
    switches = located_switches(model)
    return [
        Variable(f"{name}.mode", "1", f"Mode of {name}: {_words(switch)}", minimum=-1.0, maximum=1.0)
        for name, switch in zip(_names(switches), switches, strict=True)
    ]


def _words(switch: Switch) -> str:
    return ", ".join(f"{mode} {text}" for mode, text in sorted(switch.words) if mode in (-1, 0, 1))


def _names(switches: Sequence[Switch]) -> list[str]:
    """Return structured names; dry frictions on one motion are one switch and have both names."""
    return [
        "_and_".join([first, *(re.sub(r"[^\w]", "_", each) for each in more)])
        for first, *more in (switch.name.split("+") for switch in switches)
    ]
