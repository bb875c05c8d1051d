"""``nlsdesign simulate``: a machine driven forward in time, or by what a record has measured."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import ValueRangeError, unknown_name
from ..foundation.quantity import typeset_unit
from .driving_signals import FORMS, check_rows, read_input_file, read_inputs
from .given_numbers import BARE, given_start, given_words, with_given_values
from .named_paths import NamedPath
from .output import deck_option, examples, json_option, show_json, show_table
from .overwriting import out_file_option
from .units import Number

if TYPE_CHECKING:
    from ..components.assembly.named_parts import Assembly
    from ..model import FlatModel
    from ..simulation import Trace

_file = NamedPath(dir_okay=False)
_MOST_ROWS = 2_000_000
_SHOWN_EVENTS = 5
_ROUNDING = 1e-13
"""Share of the largest value of a signal that is no more than the rounding of its numbers, and shown as 0."""
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


def _further(given: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the suffixes of what stands beside the table."""
    return () if given["record"] or given["table_only"] else (".svg", ".html")


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
                 beside=_further, ending=".csv")  # fmt: skip
@json_option
@click.pass_context
def simulate(
    context: click.Context, /, deck_name: str, record: Path | None, mapping: Path | None, **given: Any
) -> None:
    """Simulate a machine forward in time, driven by --input; or predict a measured --record.

    Forward: writes all signals as CSV with the names of the model and units in the heads, a picture and a
    page.
    With a record: writes the predictions of the measured signals, and what the motion leaves unbalanced.
    """
    for read in (record, given["input_file"]):
        _check_out(given["out"], read)
    if record is not None:
        _refuse_beside_record(context)
        predict_record(deck_name, record, mapping, given["out"], given["as_json"])
        return
    if mapping is not None:
        raise click.UsageError("--mapping is of a --record", ctx=context)
    _forward(deck_name, given)


def _refuse_beside_record(context: click.Context) -> None:
    for parameter in context.command.params:
        source = context.get_parameter_source(parameter.name or "")
        if parameter.name in _FORWARD and source is click.core.ParameterSource.COMMANDLINE:
            words = (
                f"{parameter.opts[0]} stands beside --record, whose signals drive the model; leave one out"
            )
            raise click.UsageError(words, ctx=context)


def _check_out(out: Path, read: Path | None) -> None:
    """Refuse to write over what is read."""
    if read is not None and out.exists() and read.exists() and out.samefile(read):
        raise ValueRangeError(f"--out {out}", "is the file that is read", next_step="name another file")


def _forward(deck_name: str, given: Mapping[str, Any]) -> None:
    from ..components.assembly.deck_writer import declare
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps
    from ..model import flatten
    from ..simulation import limits_reached, measure
    from ..simulation import simulate as integrate

    actuator, values = with_given_values(declare(load_deck(deck_name)), given["values"])
    actuator = _read_as_asked(actuator, given["friction"])
    model = flatten(actuator)
    inputs: dict[str, Any] = dict(read_inputs(model, given["inputs"]))
    times = _times(given["stop"], given["step"])
    if given["input_file"] is not None:
        inputs, times = _with_file(given, model, inputs)
    if times is None:
        raise ValueRangeError("--stop", "is not given", next_step='write for instance --stop "2 s"')
    check_rows(inputs, float(times[-1]), float(times[1] - times[0]))
    start, begin = given_start(model, given["initial"])
    _chosen(model, given["signals"])  # before the work
    steps = Steps()
    with steps.step("simulation"):
        run = integrate(model, times, inputs=inputs, start=start)
    warnings = [*map(str, run.warnings), *map(str, limits_reached(model, run))]
    shown = _shown(model, run, given["signals"])
    written = _only(run, _chosen(model, given["signals"]))
    if given["readings"] is not None:
        written = _recorded(measure(run, actuator, seed=given["readings"]), model, run)
    written.write_csv(given["out"])
    files = [given["out"]]
    if not given["table_only"]:
        files += _drawn(model, run, shown, (given["out"], deck_name, warnings, {**values, **begin}))
    if given["as_json"]:
        show_json(_content(run, shown, warnings, files) | {"values": values, "initial": begin})
        return
    for line in given_words(values, begin):
        click.echo(line)
    show_table(f"{model.name} over {times[-1]:g} s", _COLUMNS, _rows(run, shown))
    for event in run.events[:_SHOWN_EVENTS]:
        click.echo(f"event: {event}")
    if len(run.events) > _SHOWN_EVENTS:
        where = "" if given["table_only"] else f", all in {files[-1]}"
        click.echo(f"and {len(run.events) - _SHOWN_EVENTS} more events{where}")
    for each in warnings:
        click.echo(f"warning: {each}")
    click.echo(f"written: {', '.join(map(str, files))}")


_COLUMNS = ("signal", "smallest", "largest", "rms", "at the end", "unit")


def _read_as_asked(actuator: Assembly, friction: str) -> Assembly:
    """Return the machine with the reading of friction that is asked for."""
    from ..components.assembly.changed_copies import sharpened, smoothed

    if friction == "sharp":
        return sharpened(actuator)
    return smoothed(actuator) if friction == "smooth" else actuator


def _times(stop: float | None, step: float) -> Any:
    """Return equal steps no longer than asked for, ``None`` without an end."""
    import numpy as np

    if stop is None:
        return None
    if step > stop:
        raise ValueRangeError(
            f"--step {step:g} s", f"is longer than the run, {stop:g} s", next_step="take a shorter --step"
        )
    count = max(1, math.ceil(stop / step * (1.0 - 1e-12)))
    if count > _MOST_ROWS:
        raise ValueRangeError(
            f"--stop {stop:g} s in steps of {step:g} s",
            f"are {count} rows, at most {_MOST_ROWS} are written",
            next_step="take a longer --step",
        )  # fmt: skip
    return np.linspace(0.0, stop, count + 1)


def _with_file(given: Mapping[str, Any], model: FlatModel, typed: Mapping[str, Any]) -> tuple[Any, Any]:
    """Return all inputs with those of the file, and the times; linear between its rows."""
    import numpy as np

    time, columns = read_input_file(given["input_file"], model)
    for name in columns:
        if name in typed:
            raise ValueRangeError(
                f"--input {name}", f"stands in {given['input_file'].name} too", next_step="leave one out"
            )
    stop = given["stop"] if given["stop"] is not None else float(time[-1])
    if stop > time[-1] * (1.0 + 1e-9):
        raise ValueRangeError(
            f"--stop {stop:g} s", f"lies behind the end of {given['input_file'].name}, {time[-1]:g} s",
            next_step="leave it out, or give a longer file",
        )  # fmt: skip
    times = _times(stop, given["step"])
    return {**typed, **{n: np.interp(times, time, v) for n, v in columns.items()}}, times


def _chosen(model: FlatModel, globs: Sequence[str]) -> list[str]:
    """Return the names that fit one of the globs, all without a glob."""
    everything = model.states + model.inputs + model.outputs + model.signals
    names = list(dict.fromkeys(v.name for v in everything))
    for each in globs:
        if not fnmatch.filter(names, each):
            raise unknown_name("--signals", each, names)
    return [n for n in names if not globs or any(fnmatch.fnmatchcase(n, each) for each in globs)]


def _shown(model: FlatModel, run: Trace, globs: Sequence[str]) -> list[str]:
    """Return what is listed and drawn: inputs, motions, torques and forces of springs, strains."""
    if globs:
        return _chosen(model, globs)
    names = [v.name for v in model.inputs]
    names += [name for body in model.bodies for name in (body.motion, body.rate)]
    for spring in model.springs:
        names += [spring.effort, *(piece.strain for cam in spring.cams for piece in cam.specimens)]
    return [name for name in dict.fromkeys(names) if name in run]


def _only(run: Trace, names: Sequence[str]) -> Trace:
    from dataclasses import replace

    return replace(run, signals={name: run[name] for name in names}, units={n: run.units[n] for n in names})


def _recorded(readings: Trace, model: FlatModel, run: Trace) -> Trace:
    """Return the readings, and the inputs that no sensor reads, as a bench would record them."""
    seen = {reading.measured for reading in model.readings}
    names = [v.name for v in model.inputs if v.name not in seen]
    return readings.with_signals({n: run[n] for n in names}, {n: run.units[n] for n in names})


def _drawn(
    model: FlatModel,
    run: Trace,
    shown: Sequence[str],
    about: tuple[Path, str, Sequence[str], Mapping[str, str]],
) -> list[Path]:
    """Write the picture and the page beside the table."""
    from ..presentation.figures import run_over_time, write_figures
    from ..presentation.report import FigureSection, FileSection, TableSection, TextSection, write_report

    out, deck_name, warnings, taken = about
    picture = run_over_time(run, shown)
    (file,) = write_figures(out.parent, {out.stem: picture})
    page = out.with_suffix(".html")
    rows = tuple((f"{event.time:.6g}", event.name, event.what) for event in run.events)
    sections = [
        TextSection("Warnings", "\n\n".join(warnings) or "No law leaves its range, no limit is reached."),
        FigureSection("Signals over time", picture, caption="Signals of one unit share a panel."),
        TableSection("Sizes", _COLUMNS, tuple(_sized(run, shown)), caption="Over the whole run."),
        *(
            [
                TableSection(
                    "Events",
                    ("time in s", "part", "what"),
                    rows,
                    caption="What sticks, slides, strikes or switches, and when.",
                    folded=True,
                )
            ]
            if rows
            else []
        ),
        FileSection("Files", {out: "all rows", file: "the picture"}, caption="Written beside this page."),
    ]
    facts = {"deck": f"`{deck_name}`", "time": f"{run.time[-1]:g} s", **taken}
    return [file, write_report(page, *sections, title=f"{model.name}: simulation", facts=facts)]


def _sizes(values: Any) -> tuple[float, float, float, float]:
    import numpy as np

    sizes = [values.min(), values.max(), np.sqrt(np.mean(values**2)), values[-1]]
    least = _ROUNDING * float(np.max(np.abs(values)))
    smallest, largest, rms, last = (float(size) if abs(size) > least else 0.0 for size in sizes)
    return smallest, largest, rms, last


def _sized(run: Trace, names: Sequence[str]) -> list[tuple[str | float, ...]]:
    return [(n, *_sizes(run[n]), typeset_unit(run.units[n])) for n in names]


def _rows(run: Trace, names: Sequence[str]) -> list[tuple[str, ...]]:
    return [(str(n), *(f"{size:.4g}" for size in sizes), str(u)) for n, *sizes, u in _sized(run, names)]


def _content(run: Trace, names: Sequence[str], warnings: list[str], files: list[Path]) -> dict[str, Any]:
    heads = ("smallest", "largest", "rms", "last")
    sizes = {n: dict(zip(heads, _sizes(run[n]), strict=True)) | {"unit": run.units[n]} for n in names}
    events = [{"time": e.time, "name": e.name, "what": e.what} for e in run.events]
    return {"signals": sizes, "events": events, "warnings": warnings, "files": files}


def predict_record(deck_name: str, record: Path, mapping: Path | None, out: Path, as_json: bool) -> None:
    """Drive a deck with a measured record; write its predictions and print their errors."""
    from ..bench.discrepancy import band_errors, predict
    from ..bench.identification import load_record
    from ..components.assembly.deck_writer import declare
    from ..foundation.deck import load_deck
    from ..model import flatten

    actuator = declare(load_deck(deck_name))
    records = load_record(record, flatten(actuator), mapping=mapping)
    (measured,) = records.records
    predicted = predict(actuator, records, measured.name)
    predicted.write_csv(out)
    rows = agreement_rows(measured.trace, predicted)
    band = band_errors(actuator, records, measured.name)
    if as_json:
        rms = {name: float(value) for name, value, _ in rows}
        shown = {"rms": rms, "in_band": {name: each._asdict() for name, each in band.items()}}
        show_json({"file": out, **shown, "warnings": [str(each) for each in predicted.warnings]})
        return
    sizes = {n: (f"{each.error:.4g}", f"{each.noise_floor:.4g}") for n, each in band.items()}
    columns = ("signal", "rms error", "in the band of a fit", "noise floor there", "unit")
    table = [(name, rms, *sizes.get(name, ("", "")), unit) for name, rms, unit in rows]
    show_table(f"{record.name} against {actuator.name}", columns, table)
    for each in predicted.warnings:
        click.echo(f"warning: {each}")
    click.echo(f"written: {out}")


def agreement_rows(measured: Trace, predicted: Trace) -> list[tuple[Any, ...]]:
    """Return name, rms error and unit of each predicted signal; one that is not measured should be zero."""
    import numpy as np

    rows = []
    for name, values in predicted.signals.items():
        error = values - measured[name] if name in measured else values
        rows.append((name, f"{float(np.sqrt(np.mean(error**2))):.4g}", typeset_unit(predicted.units[name])))
    return rows
