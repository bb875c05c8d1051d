"""``nlsdesign simulate``: a machine driven forward in time, or by what a record has measured."""

from __future__ import annotations

import fnmatch
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import ValueRangeError, unknown_name
from ..foundation.quantity import typeset_unit
from .options import deck_option, json_option, machine_of
from .output import examples, show_json, show_table
from .overwriting import out_file_option
from .typed_signals import BARE, FORMS, given_start, read_inputs, with_given_values
from .typed_values import NamedPath, Number

if TYPE_CHECKING:
    from ..components import Assembly
    from ..foundation.arrays import Array
    from ..model import FlatModel

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
