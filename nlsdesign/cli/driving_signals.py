"""What drives a simulation: constants, sines and steps as they are typed, and columns of a file."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..foundation.errors import MeasurementError, NlsError, UnitError, ValueRangeError, nearest
from ..foundation.quantity import parse_unit, same_dimension, typeset_unit, with_unit
from ..foundation.written_numbers import name_and_unit
from .units import split_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..model import FlatModel
    from ..simulation import Sine

_WAVE = re.compile(r"\s(?:sine|step)\s|@")
FORMS = "'2 A', '2 A sine 5 Hz', '2@5', '1 A + 2 A sine 5 Hz' or '2 A step 0.1 s'"


_ROWS_OF_A_PERIOD = 4


@dataclass(frozen=True)
class StepAt:
    """Zero, and from a time on a constant.

    Parameters
    ----------
    size
        In the unit of the input.
    begin
        In s.
    """

    size: float
    begin: float

    def __call__(self, time: float) -> float:
        """Return the value at a time."""
        return self.size if time >= self.begin else 0.0


def read_driving_signal(text: str, unit: str) -> Sine | StepAt:
    """Read a constant, a sine or a step.

    ``unit``: of the input; a number without a unit is in it.
    """
    from ..simulation import Sine

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


def read_pairs(option: str, given: Sequence[str]) -> dict[str, str]:
    """Return what ``NAME=TEXT`` options give, by name."""
    pairs: dict[str, str] = {}
    for each in given:
        name, sign, text = (part.strip() for part in each.partition("="))
        if not (name and sign and text):
            raise ValueRangeError(f"{option} '{each}'", "is not NAME=VALUE", next_step="write NAME=VALUE")
        if name in pairs:
            raise ValueRangeError(f"{option} '{each}'", f"'{name}' is given twice", next_step="remove one")
        pairs[name] = text
    return pairs


def read_inputs(model: FlatModel, given: Sequence[str]) -> dict[str, Sine | StepAt]:
    """Return the inputs that are typed, and the speeds that follow from prescribed motions."""
    units = {v.name: v.unit for v in model.inputs}
    inputs: dict[str, Sine | StepAt] = {}
    for name, text in read_pairs("--input", given).items():
        _check_input(f"--input {name}", name, model)
        try:
            inputs[name] = read_driving_signal(text, units[name])
        except NlsError as error:
            raise error.at(f"--input {name}") from None
    return inputs | _rates_of(model, inputs)


def check_rows(inputs: Mapping[str, Any], stop: float, step: float) -> None:
    """Refuse sines that the rows of a run cannot show, and steps that come after its end.

    The machine is driven by the sine itself, but table, picture and sizes know the rows alone: with fewer
    than four to a period they show another signal.

    ``inputs``: by name; what is neither sine nor step is passed over.
    """
    from ..simulation import Sine

    for name, signal in inputs.items():
        if isinstance(signal, Sine) and step * abs(signal.frequency) > (1.0 + 1e-9) / _ROWS_OF_A_PERIOD:
            raise ValueRangeError(
                f"--input {name}: {signal.frequency:g} Hz",
                f"has {1.0 / (step * abs(signal.frequency)):.2g} rows to a period, at least "
                f"{_ROWS_OF_A_PERIOD} are needed",
                next_step=f"write --step '{50.0 / abs(signal.frequency):.2g} ms'",
            )
        if isinstance(signal, StepAt) and signal.begin >= stop:
            raise ValueRangeError(
                f"--input {name}: step at {signal.begin:g} s",
                f"comes after the run, which ends at {stop:g} s",
                next_step="give a longer --stop, or an earlier step",
            )  # fmt: skip


def _check_input(where: str, name: str, model: FlatModel) -> None:
    names = [v.name for v in model.inputs]
    if name not in names:
        raise ValueRangeError(
            where,
            f"{model.name} has no such input",
            did_you_mean=nearest(name, names),
            next_step=f"its inputs are {', '.join(names) or 'none'}",
        )


def _rates_of(model: FlatModel, inputs: Mapping[str, Sine | StepAt]) -> dict[str, Sine]:
    """Return the speeds of bodies whose motion is prescribed, where only that is given."""
    from ..simulation import Sine

    rates: dict[str, Sine] = {}
    names = {v.name for v in model.inputs}
    for body in model.bodies:
        motion = inputs.get(body.motion)
        if motion is None or body.rate not in names or body.rate in inputs:
            continue
        if isinstance(motion, StepAt):
            raise ValueRangeError(
                f"--input {body.motion}",
                "is a prescribed motion, which cannot jump",
                next_step=f"give a sine or a constant, or {body.motion} and {body.rate} in a file",
            )
        speed = 2.0 * math.pi * motion.frequency * motion.amplitude
        rates[body.rate] = Sine(speed, motion.frequency, phase=math.pi / 2.0)
    return rates


def read_input_file(file: Path, model: FlatModel) -> tuple[Any, dict[str, Any]]:
    """Return the times of a file in s, from zero, and the inputs among its columns in SI.

    Heads are ``time [s]`` and ``name [unit]``, as a simulation writes them; other columns are passed over.
    """
    import numpy as np

    from ..bench.identification.records.column_heads import times_among
    from ..foundation.csv_tables import heads_with_units, read_csv

    table = read_csv(file)
    heads = dict(zip(heads_with_units(file.name, table.heads, table.units), table.heads, strict=True))
    times = times_among(list(heads))
    if not times:
        raise MeasurementError(file.name, "has no column of time", next_step="name it 'time [s]'")
    head, unit = times[0]
    time = table.columns[heads[head]] * parse_unit(unit).factor
    if len(time) < 2 or not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0.0):
        raise MeasurementError(
            f"{file.name}: column '{heads[head]}'", "needs at least two times that ascend",
            next_step="sort the rows, and leave out those that are double",
        )  # fmt: skip
    units = {v.name: v.unit for v in model.inputs}
    columns: dict[str, Any] = {}
    for each, own in heads.items():
        name, given = name_and_unit(each)
        if name in units:
            columns[name] = _column(file.name, own, table.columns[own], (given, units[name]), len(time))
    if not columns:
        raise MeasurementError(
            file.name, f"has no column of an input of {model.name}",
            next_step=f"name a column '{_head_like(model)}'",
        )  # fmt: skip
    return time - time[0], columns


def _head_like(model: FlatModel) -> str:
    return next((f"{v.name} [{v.unit}]" for v in model.inputs), "input [unit]")


def _column(file: str, head: str, values: Any, units: tuple[str | None, str], rows: int) -> Any:
    import numpy as np

    given, wanted = units
    place = f"{file}: column '{head}'"
    if given is None or not same_dimension(given, wanted):
        unit = typeset_unit(wanted) or "1"
        raise MeasurementError(
            place, f"is not in a unit like {unit}", next_step=f"write [{wanted}] behind it"
        )
    if len(values) != rows or not np.all(np.isfinite(values)):
        raise MeasurementError(place, "is not a number in every row", next_step="fill the cells")
    return values * parse_unit(given).factor
