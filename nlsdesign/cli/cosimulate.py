"""``nlsdesign cosimulate`` and ``export ssp``: FMUs wired by name, run together or written as one archive."""

from __future__ import annotations

import fnmatch
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import ValueRangeError, unknown_name
from ..foundation.quantity import Quantity, quantity, typeset_unit
from .export import export
from .options import json_option
from .output import examples, show_json, show_table, show_written
from .overwriting import out_file_option
from .typed_values import NamedPath, Number, parse_number, read_pairs

if TYPE_CHECKING:
    from ..export import Convergence, CoSimulation, FmuSystem, SamplesOf, Wire
    from ..simulation import Sine

_LATE = "late:"
_SAMPLES = re.compile(r"(?P<count>[^a-z:]*)samples?(:(?P<instance>\w+))?$")
_NUMBER = re.compile(r"(?P<number>[-+]?[\d.]+([eE][-+]?\d+)?)\s*(?P<unit>.*)$")


WIRE_HELP = (
    "Input and output as instance.variable. GAIN is a number, with a unit where both ends have different "
    "ones: '*-1', '*0.02 m/rad'. DELAY is a time or a number of samples of the instance that computes the "
    "value, or of another: '@2ms', '@1sample', '@1sample:controller'. TO=late:FROM is TO=FROM@1sample. "
    "Repeatable."
)


@click.command(
    "cosimulate",
    epilog=examples(
        "nlsdesign cosimulate --fmu plant=out/fmu/plant.fmu --input plant.motor.current=0.5@1 "
        "--stop '2 s' --out out/run.csv",
        "nlsdesign cosimulate --system out/system.ssp --stop '2 s' --step '1 ms' --halvings 3 "
        "--out out/run.csv --json",
    ),
)
@click.option("--fmu", "fmus", multiple=True, metavar="INSTANCE=FILE", help="Repeatable.")
@click.option("--system", type=NamedPath(dir_okay=False), default=None, metavar="FILE.ssp",
              help="An SSP archive instead of --fmu; wires and parameters are added to its own.")  # fmt: skip
@click.option("--wire", "wires", multiple=True, metavar="TO=FROM[*GAIN][@DELAY]", help=WIRE_HELP)
@click.option("--input", "inputs", multiple=True, metavar="INPUT=NUMBER|AMPLITUDE@HERTZ",
              help="A constant or a sine; repeatable.")  # fmt: skip
@click.option("--set", "parameters", multiple=True, metavar="PARAMETER=NUMBER", help="Repeatable.")
@click.option("--order", multiple=True, metavar="INSTANCE",
              help="Order in which sampled FMUs compute; without it all read before any computes. "
                   "Repeatable.")  # fmt: skip
@click.option("--stop", type=Number("s", above=0.0), required=True, help="End, for instance '5 s'.")
@click.option(
    "--step",
    type=Number("ms", above=0.0),
    default=None,
    help="Longest communication step, for instance '1 ms'.",
)
@click.option("--coupling", type=click.Choice(["extrapolated", "iterated", "held"]), default="extrapolated",
              show_default=True, help="Of continuous FMUs: second order, second order with roll-back, "
                                      "first order.")  # fmt: skip
@click.option(
    "--patience",
    type=Number("s", above=0.0),
    default=30.0,
    help="Longest call into an FMU; '30 s' by default.",
)
@click.option("--halvings", type=click.IntRange(2, 10), default=None,
              help="Also halve the step so often and print how the signals converge.")  # fmt: skip
@click.option("--signals", multiple=True, metavar="GLOB",
              help="What is listed, e.g. 'plant.spring.*'; by default inputs and outputs of the FMUs. All is "
              "written. Repeatable.")  # fmt: skip
@out_file_option(None, "CSV to write.", ending=".csv")
@json_option
def cosimulation(stop: float, halvings: int | None, out: Path, as_json: bool, **given: Any) -> None:
    """Run FMUs together. Numbers are in the units that the FMUs state for their variables.

    The FMUs run in a process of their own. Row k of the file shows what holds at its time. Where continuous
    FMUs are coupled or driven, the error of coupling is estimated by a second run with half the step.
    """
    import tempfile

    from ..export import Coupling, Extrapolated, Held, Iterated, Stepping, convergence
    from ..foundation.progress import Steps

    # Refuse to write over what is read.
    for words in [*given["fmus"], *([str(given["system"])] if given.get("system") else [])]:
        file = Path(words.partition("=")[2] or words)
        if out.exists() and file.exists() and file.samefile(out):
            raise ValueRangeError(
                f"--out {out}", "is an FMU or a system that is read", next_step="name another file: run.csv"
            )
    steps = Steps()
    with tempfile.TemporaryDirectory(prefix="nlsdesign-system-") as folder:
        system = _system(given, Path(folder))
        inputs = read_pairs("--input", given["inputs"], _signal)
        couplings: dict[str, type[Coupling]] = {
            "extrapolated": Extrapolated, "iterated": Iterated, "held": Held,
        }  # fmt: skip
        stepping = Stepping(
            given["step"], coupling=couplings[given["coupling"]](), patience=given["patience"], progress=steps
        )
        for glob in given["signals"]:  # before the work
            if not fnmatch.filter(names := [*system.recorded(), *inputs], glob):
                raise unknown_name("--signals", glob, names)
        with steps.step("co-simulation"):
            run = system.run(inputs=inputs, stop=stop, stepping=stepping)
        study = None
        if halvings is not None:
            with steps.step("halving the step"):
                study = convergence(system, inputs=inputs, stop=stop, stepping=stepping, halvings=halvings)
    listed = _listed(run, given["signals"])
    run.trace.write_csv(out)
    if as_json:
        show_json(_as_json(run, study, out))
        return
    _show(run, study, system.wires, listed)
    left = len(run.trace.signals) - len(listed)
    if left:
        click.echo(f"and {left} more signals in {out}; --signals GLOB lists those of a name")
    click.echo(f"written: {out}, {len(run.time)} rows at most {1e3 * run.step:g} ms apart")


def _system(given: Mapping[str, Any], folder: Path) -> FmuSystem:
    """Return the FMUs and wires that are given, or those of an archive and what is added to it."""
    from ..export import FmuSystem, read_ssp

    own = FmuSystem(
        fmus=read_pairs("--fmu", given["fmus"], Path),
        wires=read_pairs("--wire", given["wires"], read_wire),
        parameters=read_pairs("--set", given["parameters"], _finite),
        order=given["order"],
    )
    if given["system"] is None:
        if not own.fmus:
            hint = "write --fmu INSTANCE=FILE or --system FILE.ssp"
            raise ValueRangeError("no FMU", "is given", next_step=hint)
        return own
    if own.fmus:
        raise ValueRangeError("--system", "holds the FMUs already", next_step="leave --fmu out")
    read = read_ssp(given["system"], folder)
    return FmuSystem(
        fmus=read.fmus,
        wires={**read.wires, **own.wires},
        parameters={**read.parameters, **own.parameters},
        order=own.order or read.order,
    )


def _as_json(run: CoSimulation, study: Convergence | None, out: Path) -> dict[str, Any]:
    import numpy as np

    ends = {
        n: {"last": float(v[-1]), "rms": float(np.sqrt(np.mean(v**2))), "unit": run.trace.units[n]}
        | ({"error": run.errors[n]} if n in run.errors else {})
        for n, v in run.trace.signals.items()
    }
    content: dict[str, Any] = {"file": out, "step": run.step, "delays": dict(run.delays), "signals": ends}
    if study is not None:
        changes = {
            n: {"differences": d, "orders": [None if math.isnan(o) else o for o in study.orders(n)]}
            for n, d in study.differences.items()
        }
        content["convergence"] = {"steps": study.steps, "signals": changes}
    return content


def _listed(run: CoSimulation, globs: tuple[str, ...]) -> list[str]:
    """Return the names that fit one of the globs; without a glob inputs and outputs, but no items of rows."""
    names = list(run.trace.signals)
    if globs:
        return [n for n in names if any(fnmatch.fnmatchcase(n, each) for each in globs)]
    return [n for n in names if n in run.ends and not n.endswith("]")] or names


def _show(
    run: CoSimulation, study: Convergence | None, wires: Mapping[str, str | Wire], listed: Sequence[str]
) -> None:
    from ..export import as_wire

    rows = []
    for to, delay in run.delays.items():
        wire = as_wire(wires[to])
        rows.append((to, wire.source, str(wire.gain), f"{1e3 * delay:g} ms"))
    if rows:
        show_table("Wires", ("input", "reads", "gain", "delay"), rows)
    signals = []
    for n in listed:
        v = run[n]
        error = f"{run.errors[n]:.1e}" if n in run.errors else "-"
        unit = typeset_unit(run.trace.units[n])
        signals.append((n, f"{v.min():.4g}", f"{v.max():.4g}", f"{v[-1]:.4g}", error, unit))
    show_table("Signals", ("name", "smallest", "largest", "last", "coupling error", "unit"), signals)
    if study is None:
        return
    heads = [f"{1e3 * step:g} ms" for step in study.steps[:-1]]
    changes = []
    for n in (each for each in listed if each in study.differences):
        differences = study.differences[n]
        orders = ["" if math.isnan(order) else f" (order {order:.2f})" for order in study.orders(n)]
        cells = [f"{d:.2e}{order}" for d, order in zip(differences, ["", *orders], strict=True)]
        changes.append((n, *cells))
    show_table("Change when the step is halved", ("name", *heads), changes)


def read_wire(text: str) -> Wire:
    """Read ``FROM[*GAIN][@DELAY]``; ``late:FROM`` is ``FROM@1sample``."""
    from ..export import SamplesOf, Wire

    late = text.startswith(_LATE)
    rest, at, delay = text.removeprefix(_LATE).partition("@")
    source, times, gain = (part.strip() for part in rest.partition("*"))
    if not source or bool(times) != bool(gain) or bool(at) != bool(delay.strip()) or (late and at):
        raise ValueRangeError(
            f"--wire from '{text}'", "is not FROM[*GAIN][@DELAY]", next_step=f"write for instance {_EXAMPLES}"
        )
    waits = SamplesOf() if late else _delay(delay.strip()) if at else 0.0
    factor: float | Quantity = 1.0
    if gain:
        match = _NUMBER.match(gain)
        if not match:
            raise ValueRangeError(f"gain '{gain}' of a --wire", "does not start with a number")
        factor = float(match["number"])
        factor = quantity(factor, match["unit"]) if match["unit"] else factor
    return Wire(source, gain=factor, delay=waits)


_EXAMPLES = (
    "'link.torque=actuator.load.reaction*-1' or 'plant.motor.current=controller.motor.current@1sample'"
)


def _delay(text: str) -> float | SamplesOf:
    from ..export import SamplesOf

    samples = _SAMPLES.match(text)
    if samples:
        return SamplesOf(samples["instance"], float(samples["count"].strip() or 1.0))
    match = _NUMBER.match(text)
    if not match:
        raise ValueRangeError(
            f"delay '{text}' of a --wire", "is neither a time nor a number of samples",
            next_step="write for instance '@2ms', '@1sample' or '@1sample:controller'",
        )  # fmt: skip
    return parse_number(f"{match['number']} {match['unit']}", "ms").number


def _signal(text: str) -> Sine:
    from ..simulation import Sine

    size, at, frequency = text.partition("@")
    return Sine(_finite(size), _finite(frequency)) if at else Sine(0.0, 0.0, _finite(size))


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError
    return number


@export.command(
    "ssp",
    epilog=examples(
        "nlsdesign export ssp --fmu plant=out/fmu/plant.fmu --fmu observer=out/fmu/observer.fmu "
        "--wire observer.motor_encoder.reading=plant.motor_encoder.reading --out out/system.ssp"
    ),
)
@click.option("--fmu", "fmus", multiple=True, required=True, metavar="INSTANCE=FILE", help="Repeatable.")
@click.option("--wire", "wires", multiple=True, metavar="TO=FROM[*GAIN][@DELAY]", help=WIRE_HELP)
@click.option("--set", "parameters", multiple=True, metavar="PARAMETER=NUMBER", help="Repeatable.")
@click.option("--order", multiple=True, metavar="INSTANCE", help="As for 'cosimulate'; repeatable.")
@click.option(
    "--input", "inputs", multiple=True, metavar="INPUT", help="Becomes an input of the system; repeatable."
)
@click.option("--version", type=click.Choice(["1.0", "2.0"]), default="1.0", show_default=True,
              help="Of the standard.")  # fmt: skip
@out_file_option(None, "File to write, NAME.ssp.", ending=".ssp")
@json_option
def export_ssp(version: str, out: Path, as_json: bool, **given: tuple[str, ...]) -> None:
    """Write FMUs and their wires as an SSP archive. Other tools and 'cosimulate --system' run it."""
    from ..export import write_ssp

    written = write_ssp(
        out,
        fmus=read_pairs("--fmu", given["fmus"], Path),
        wires=read_pairs("--wire", given["wires"], read_wire),
        parameters=read_pairs("--set", given["parameters"], float),
        order=given["order"],
        inputs=given["inputs"],
        version=version,
    )
    for note in written.notes:
        click.echo(f"an annotation, which other tools may ignore: {note}", err=True)
    show_written(as_json, (), [written.path], annotations=list(written.notes))
