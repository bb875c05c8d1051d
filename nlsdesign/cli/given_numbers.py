"""Numbers and states that ``simulate`` takes instead of the deck's; one rule for those without a unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from ..foundation.errors import NlsError, UnitError, unknown_name
from ..foundation.quantity import Quantity, parse_unit, quantity, typeset_unit, with_unit
from .driving_signals import read_pairs, size_in
from .units import split_number

if TYPE_CHECKING:
    from ..components.assembly.named_parts import Assembly
    from ..model import FlatModel

BARE = "A number without a unit is in that of the model (rad, N·m, kg·m²), as tables and heads show it"
"""The rule, for help texts."""


def with_given_values(actuator: Assembly, given: Sequence[str]) -> tuple[Assembly, dict[str, str]]:
    """Return the machine with other numbers, and in words what was taken, by name."""
    declared, taken = actuator.quantities(), dict[str, str]()
    for name, text in read_pairs("--value", given).items():
        if name not in declared:
            raise unknown_name("--value", name, declared)
        try:
            changed = _value(text, declared[name])
            actuator = actuator.with_values({name: changed})
        except NlsError as error:
            raise error.at(f"--value {name}") from None
        taken[name] = f"{changed} in place of {declared[name]}"
    return actuator, taken


def _value(text: str, declared: Quantity) -> Quantity:
    if isinstance(declared.value, tuple):
        raise UnitError(
            f"'{text}'", "stands for a row of numbers", next_step="change the row in a copy of the deck"
        )
    try:
        number, unit = split_number(text)
    except UnitError as error:
        step = error.next_step or f"write for instance '{declared}'"
        raise UnitError(error.thing, error.rule, next_step=step) from None
    if not unit and parse_unit(declared.unit).factor != 1.0:
        # The deck shows it in this unit and the model computes in another: either could be meant.
        raise UnitError(
            f"'{text}'", f"has no unit, and the deck writes it in {typeset_unit(declared.unit)}, not in SI",
            next_step=f"write '{with_unit(text.strip(), declared.unit)}' if that is meant",
        )  # fmt: skip
    return quantity(number, unit or declared.unit, source="given on the command line")


def given_start(model: FlatModel, given: Sequence[str]) -> tuple[dict[str, float], dict[str, str]]:
    """Return the states at the begin in SI, and in words what was taken, by name."""
    units = {v.name: v.unit for v in model.states}
    start: dict[str, float] = {}
    for name, text in read_pairs("--initial", given).items():
        if name not in units:
            raise unknown_name("--initial", name, units)
        try:
            start[name] = size_in(text, units[name])
        except NlsError as error:
            raise error.at(f"--initial {name}") from None
    return start, {name: with_unit(f"{value:.6g}", units[name]) for name, value in start.items()}


def given_words(values: Mapping[str, str], start: Mapping[str, str]) -> list[str]:
    """Return a line for each number that was taken from the command line."""
    return [f"with {name} = {words}" for name, words in values.items()] + [
        f"begins at {name} = {words}" for name, words in start.items()
    ]
