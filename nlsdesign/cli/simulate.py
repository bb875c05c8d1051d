"""``nlsdesign simulate``: a machine driven forward in time, or by what a record has measured.

What ``simulate`` takes as typed: signals over time, numbers and states in place of the deck's.
"""

from __future__ import annotations

import fnmatch
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import NlsError, UnitError, ValueRangeError, nearest, unknown_name
from ..foundation.quantity import Quantity, parse_unit, quantity, same_dimension, typeset_unit, with_unit
from .options import deck_option, json_option, machine_of
from .output import examples, show_json, show_table
from .overwriting import out_file_option
from .typed_values import NamedPath, Number, read_pairs, split_number

if TYPE_CHECKING:
    from ..components import Assembly
    from ..foundation.arrays import Array
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


_file = NamedPath(dir_okay=False)
_SHOWN_EVENTS = 5
_FORWARD = (
    "inputs",
    "input_file",
    "stop",
    "step",
    "initial",
    "values",
    "signals",
    "friction",
    "readings",
    "table_only",
)


@click.command(
    epilog=examples(
        'nlsdesign simulate --deck austin2015_soft_spring --input "motor.current=2 A sine 2 Hz" --stop "1 s"',
        "nlsdesign simulate --deck austin2015_soft_spring --input motor.current=2@1 --stop '1 s' --json",
        "nlsdesign simulate --deck austin2015_soft_spring --initial 'motor.angle=20 deg' --stop '1 s' "
        "--friction sharp --signals 'motor.*' --table-only --out out/released.csv",
        "nlsdesign simulate --deck my.toml --record bench/run1.csv --out predicted.csv",
    )
)
@deck_option
@click.option("--input", "inputs", multiple=True, metavar="NAME=SIGNAL",
              help=f"An input over time: {FORMS}; in the unit of the model where none is written. "
              "Others rest. Repeatable.")  # fmt: skip
@click.option("--input-file", type=_file, default=None,
              help="CSV with inputs over time: heads 'time [s]' and 'motor.current [A]'.")  # fmt: skip
@click.option("--stop", type=Number("s", above=0.0), default=None,
              help="End, for instance '2 s'; by default that of --input-file.")  # fmt: skip
@click.option("--step", type=Number("ms", above=0.0), default="1 ms", show_default=True,
              help="Longest time between two rows; the integrator has steps of its own.")  # fmt: skip
@click.option("--initial", multiple=True, metavar="STATE=NUMBER",
              help=f"A state at the begin, e.g. 'motor.angle=10 deg'. {BARE}. Repeatable.")  # fmt: skip
@click.option("--value", "values", multiple=True, metavar="NAME=NUMBER",
              help="Another number of the deck, e.g. 'motor.inertia=0.02 kg*m^2'. Without a unit as for "
              "--initial, but refused where the deck writes it in mm or the like. Repeatable.")  # fmt: skip
@click.option("--signals", multiple=True, metavar="GLOB",
              help="What is written, drawn and listed, e.g. 'spring.*'; by default all is written. "
              "Repeatable.")  # fmt: skip
@click.option("--friction", type=click.Choice(["declared", "sharp", "smooth"]), default="declared",
              show_default=True, help="sharp: friction sticks and corners are located; smooth: rounded, "
              "which is quicker.")  # fmt: skip
@click.option("--readings", type=click.IntRange(0), default=None, metavar="SEED",
              help="Write what the sensors of the deck would record, with counts and noise.")  # fmt: skip
@click.option("--table-only", is_flag=True, help="Write the CSV without picture and page.")
@click.option("--record", type=_file, default=None,
              help="CSV with measured signals, which drive the model instead.")  # fmt: skip
@click.option("--mapping", type=_file, default=None,
              help="Of --record: TOML that maps columns to signals.")  # fmt: skip
@out_file_option("out/simulation/run.csv", "CSV to write; picture and page stand beside it.",
                 beside=lambda asked: () if asked["record"] or asked["table_only"] else (".svg", ".html"),
                 ending=".csv")  # fmt: skip
@json_option
@click.pass_context
def simulate(
    context: click.Context, /, deck_name: str, record: Path | None, mapping: Path | None, **given: Any
) -> None:
    """Simulate a machine, or predict a measured record. It is driven by --input, or by --record.

    Forward: writes all signals as CSV with the names of the model and units in the heads, a picture and a
    page.
    With a record: writes the predictions of the measured signals, and what the motion leaves unbalanced.
    """
    out = given["out"]
    for read in (record, given["input_file"]):
        if read is not None and out.exists() and read.exists() and out.samefile(read):
            raise ValueRangeError(f"--out {out}", "is the file that is read", next_step="name another file")
    if record is not None:
        for parameter in context.command.params:
            source = context.get_parameter_source(parameter.name or "")
            if parameter.name in _FORWARD and source is click.core.ParameterSource.COMMANDLINE:
                raise click.UsageError(
                    f"{parameter.opts[0]} stands beside --record, whose signals drive the model; "
                    "leave one out",
                    ctx=context,
                )
        predict_record(deck_name, record, mapping, given["out"], given["as_json"])
        return
    if mapping is not None:
        raise click.UsageError("--mapping is of a --record", ctx=context)
    _forward(deck_name, given)


def _forward(deck_name: str, given: Mapping[str, Any]) -> None:
    from ..components import sharpened, smoothed
    from ..foundation.progress import Steps
    from ..model import flatten
    from ..presentation.report import SIZES, write_simulation_report
    from ..simulation import (
        as_recorded,
        limits_reached,
        main_signals,
        measure,
        only,
        require_visible,
        signal_names,
        signal_sizes,
    )
    from ..simulation import simulate as integrate

    actuator, values = with_given_values(machine_of(deck_name), given["values"])
    readings: dict[str, Callable[[Assembly], Assembly]] = {"sharp": sharpened, "smooth": smoothed}
    if given["friction"] in readings:
        actuator = readings[given["friction"]](actuator)
    model, out = flatten(actuator), given["out"]
    inputs, times = _driven(given, model)
    require_visible(inputs, times)
    start, begin = given_start(model, given["initial"])
    chosen = _chosen(signal_names(model), given["signals"])  # before the work
    steps = Steps()
    with steps.step("simulation"):
        run = integrate(model, times, inputs=inputs, start=start)
    warnings = [*map(str, run.warnings), *map(str, limits_reached(model, run))]
    listed = chosen if given["signals"] else main_signals(model, run)
    written = only(run, chosen)
    if given["readings"] is not None:
        written = as_recorded(measure(run, actuator, seed=given["readings"]), model, run)
    written.write_csv(out)
    files = [out]
    if not given["table_only"]:
        facts = {"deck": f"`{deck_name}`", "time": f"{run.time[-1]:g} s", **values, **begin}
        files += write_simulation_report(out, model, run, listed, facts=facts, warnings=warnings)
    sizes = {name: signal_sizes(run[name]) for name in listed}
    if given["as_json"]:
        signals = {name: {**row, "unit": run.units[name]} for name, row in sizes.items()}
        events = [{"time": e.time, "name": e.name, "what": e.what} for e in run.events]
        show_json({"signals": signals, "events": events, "warnings": warnings, "files": files,
                   "values": values, "initial": begin})  # fmt: skip
        return
    for name, taken in values.items():
        click.echo(f"with {name} = {taken}")
    for name, taken in begin.items():
        click.echo(f"begins at {name} = {taken}")
    rows = [
        (n, *(f"{size:.4g}" for size in row.values()), typeset_unit(run.units[n])) for n, row in sizes.items()
    ]
    show_table(f"{model.name} over {times[-1]:g} s", SIZES, rows)
    for event in run.events[:_SHOWN_EVENTS]:
        click.echo(f"event: {event}")
    if len(run.events) > _SHOWN_EVENTS:
        where = "" if given["table_only"] else f", all in {files[-1]}"
        click.echo(f"and {len(run.events) - _SHOWN_EVENTS} more events{where}")
    for warning in warnings:
        click.echo(f"warning: {warning}")
    click.echo(f"written: {', '.join(map(str, files))}")


def _driven(given: Mapping[str, Any], model: FlatModel) -> tuple[dict[str, Any], Array]:
    """Return the inputs that are typed and those of a file, linear between its rows; and the times."""
    import numpy as np

    from ..bench.identification import read_input_columns
    from ..simulation import even_times

    inputs: dict[str, Any] = dict(read_inputs(model, given["inputs"]))
    stop, file = given["stop"], given["input_file"]
    if file is None:
        if stop is None:
            raise ValueRangeError("--stop", "is not given", next_step='write for instance --stop "2 s"')
        return inputs, even_times(stop, given["step"])
    time, columns = read_input_columns(file, model)
    for name in columns:
        if name in inputs:
            raise ValueRangeError(f"--input {name}", f"stands in {file.name} too", next_step="leave one out")
    stop = float(time[-1]) if stop is None else stop
    if stop > time[-1] * (1.0 + 1e-9):
        raise ValueRangeError(
            f"--stop {stop:g} s", f"lies behind the end of {file.name}, {time[-1]:g} s",
            next_step="leave it out, or give a longer file",
        )  # fmt: skip
    times = even_times(stop, given["step"])
    return {**inputs, **{n: np.interp(times, time, v) for n, v in columns.items()}}, times


def _chosen(names: Sequence[str], globs: Sequence[str]) -> list[str]:
    """Return the names that fit one of the globs, all without a glob."""
    for glob in globs:
        if not fnmatch.filter(names, glob):
            raise unknown_name("--signals", glob, names)
    return [n for n in names if not globs or any(fnmatch.fnmatchcase(n, glob) for glob in globs)]


def predict_record(deck_name: str, record: Path, mapping: Path | None, out: Path, as_json: bool) -> None:
    """Drive a deck with a measured record; write its predictions and print their errors."""
    from ..bench.discrepancy import band_errors, predict
    from ..bench.identification import load_record
    from ..model import flatten
    from ..simulation import rms_against

    actuator = machine_of(deck_name)
    records = load_record(record, flatten(actuator), mapping=mapping)
    (measured,) = records.records
    predicted = predict(actuator, records, measured.name)
    predicted.write_csv(out)
    rms = {name: f"{error:.4g}" for name, error in rms_against(measured.trace, predicted).items()}
    band = band_errors(actuator, records, measured.name)
    if as_json:
        show_json({
            "file": out, "rms": {name: float(error) for name, error in rms.items()},
            "in_band": {name: errors._asdict() for name, errors in band.items()},
            "warnings": [str(warning) for warning in predicted.warnings],
        })  # fmt: skip
        return
    sizes = {n: (f"{errors.error:.4g}", f"{errors.noise_floor:.4g}") for n, errors in band.items()}
    columns = ("signal", "rms error", "in the band of a fit", "noise floor there", "unit")
    table = [
        (name, error, *sizes.get(name, ("", "")), typeset_unit(predicted.units[name]))
        for name, error in rms.items()
    ]
    show_table(f"{record.name} against {actuator.name}", columns, table)
    for warning in predicted.warnings:
        click.echo(f"warning: {warning}")
    click.echo(f"written: {out}")
