"""What ``simulate`` takes as typed: signals over time, numbers and states in place of the deck's."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..foundation.errors import NlsError, UnitError, ValueRangeError, nearest, unknown_name
from ..foundation.quantity import Quantity, parse_unit, quantity, same_dimension, typeset_unit, with_unit
from .typed_values import read_pairs, split_number

if TYPE_CHECKING:
    from ..components import Assembly
    from ..model import FlatModel
    from ..simulation import Sine, StepAt

_WAVE = re.compile(r"\s(?:sine|step)\s|@")
FORMS = "'2 A', '2 A sine 5 Hz', '2@5', '1 A + 2 A sine 5 Hz' or '2 A step 0.1 s'"


def read_driving_signal(text: str, unit: str) -> Sine | StepAt:
    """Read a constant, a sine or a step.

    ``unit``: of the input; a number without a unit is in it.
    """
    from ..simulation import Sine, StepAt

    if len(_WAVE.findall(text)) > 1:
        raise ValueRangeError(
            f"'{text}'", "has more than one sine or step; one beside a constant is possible",
            next_step="give the sum over time by --input-file, a CSV with time and input",
        )  # fmt: skip
    first, plus, rest = (part.strip() for part in text.partition(" + "))
    offset, wave = (size_in(first, unit), rest) if plus else (0.0, text)
    sine = re.split(r"\s+sine\s+|\s*@\s*", wave.strip())
    step = re.split(r"\s+step\s+", wave.strip())
    if len(sine) == 2:
        return Sine(size_in(sine[0], unit), size_in(sine[1], "Hz"), offset)
    if len(step) == 2 and not plus:
        return StepAt(size_in(step[0], unit), size_in(step[1], "s"))
    if plus or len(sine) > 2 or len(step) > 2:
        raise ValueRangeError(f"'{text}'", "is no signal", next_step=f"write for instance {FORMS}")
    return Sine(0.0, 0.0, size_in(text, unit))


def size_in(text: str, unit: str) -> float:
    """Return a number in SI; without a unit it is taken to be in that of the model."""
    try:
        number, given = split_number(text)
    except UnitError as error:
        if error.next_step:
            raise
        raise UnitError(f"'{text}'", "is no number", next_step=f"write for instance {FORMS}") from None
    if not same_dimension(given or unit, unit):
        shown = typeset_unit(unit) or "a plain number"
        raise UnitError(
            f"'{text}'", f"is not in a unit like {shown}",
            next_step=f"write '{with_unit(f'{number:.12g}', unit)}'",
        )  # fmt: skip
    value = number * parse_unit(given or unit).factor
    if not math.isfinite(value):
        raise ValueRangeError(f"'{text}'", "is not finite", next_step="give a finite number")
    return value


def read_inputs(model: FlatModel, given: Sequence[str]) -> dict[str, Sine | StepAt]:
    """Return the inputs that are typed, and the speeds that follow from prescribed motions."""
    from ..simulation import with_prescribed_speeds

    units = {v.name: v.unit for v in model.inputs}
    inputs: dict[str, Sine | StepAt] = {}
    for name, text in read_pairs("--input", given, str).items():
        if name not in units:
            raise ValueRangeError(
                f"--input {name}",
                f"{model.name} has no such input",
                did_you_mean=nearest(name, units),
                next_step=f"its inputs are {', '.join(units) or 'none'}",
            )
        try:
            inputs[name] = read_driving_signal(text, units[name])
        except NlsError as error:
            raise error.at(f"--input {name}") from None
    return with_prescribed_speeds(model, inputs)


BARE = "A number without a unit is in that of the model (rad, N·m, kg·m²), as tables and heads show it"
"""The rule, for help texts."""


def with_given_values(actuator: Assembly, given: Sequence[str]) -> tuple[Assembly, dict[str, str]]:
    """Return the machine with other numbers, and in words what was taken, by name."""
    declared, taken = actuator.quantities(), dict[str, str]()
    for name, text in read_pairs("--value", given, str).items():
        if name not in declared:
            raise unknown_name("--value", name, declared)
        try:
            changed = _changed(text, declared[name])
            actuator = actuator.with_values({name: changed})
        except NlsError as error:
            raise error.at(f"--value {name}") from None
        taken[name] = f"{changed} in place of {declared[name]}"
    return actuator, taken


def _changed(text: str, declared: Quantity) -> Quantity:
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
    for name, text in read_pairs("--initial", given, str).items():
        if name not in units:
            raise unknown_name("--initial", name, units)
        try:
            start[name] = size_in(text, units[name])
        except NlsError as error:
            raise error.at(f"--initial {name}") from None
    return start, {name: with_unit(f"{value:.6g}", units[name]) for name, value in start.items()}
