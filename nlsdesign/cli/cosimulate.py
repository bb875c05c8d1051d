"""``nlsdesign cosimulate``: FMUs wired by name and run together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from ..errors import ValueRangeError
from ..quantity import typeset_unit
from .output import json_option, show_json, show_table
from .units import Number

if TYPE_CHECKING:
    from ..simulation import Sine

T = TypeVar("T")
_LATE = "late:"


@click.command("cosimulate")
@click.option("--fmu", "fmus", multiple=True, required=True, metavar="INSTANCE=FILE", help="Repeatable.")
@click.option("--wire", "wires", multiple=True, metavar="TO=FROM",
              help="Input and output as instance.variable; TO=late:FROM reads the value of one "
                   "communication step before; repeatable.")  # fmt: skip
@click.option("--input", "inputs", multiple=True, metavar="INPUT=NUMBER|AMPLITUDE@HERTZ",
              help="A constant or a sine; repeatable.")  # fmt: skip
@click.option("--set", "parameters", multiple=True, metavar="PARAMETER=NUMBER", help="Repeatable.")
@click.option("--order", multiple=True, metavar="INSTANCE", help="Order in which the FMUs step; repeatable.")
@click.option("--stop", type=Number("s"), required=True, help="End, for instance '5 s'.")
@click.option("--step", type=Number("ms"), default=None, help="Communication step, for instance '1 ms'.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="CSV to write.")
@json_option
def cosimulation(stop: float, step: float | None, out: Path, as_json: bool, **given: tuple[str, ...]) -> None:
    """Run FMUs together; numbers are in the units that the FMUs state for their variables."""
    import numpy as np

    from ..export import cosimulate

    joined = _pairs("--wire", given["wires"], _source)
    run = cosimulate(
        fmus=_pairs("--fmu", given["fmus"], Path),
        wires=joined,
        inputs=_pairs("--input", given["inputs"], _signal),
        stop=stop,
        step=step,
        order=given["order"],
        parameters=_pairs("--set", given["parameters"], float),
    )
    run.trace.write_csv(out)
    if as_json:
        ends = {n: {"last": float(v[-1]), "rms": float(np.sqrt(np.mean(v**2))), "unit": run.trace.units[n]}
                for n, v in run.trace.signals.items()}  # fmt: skip
        show_json({"file": out, "step": run.step, "delays": dict(run.delays), "signals": ends})
        return
    rows = [(to, str(joined[to]), str(delay)) for to, delay in run.delays.items()]
    show_table("Wires", ("input", "reads", "delay in steps"), rows)
    signals = [
        (n, f"{v.min():.4g}", f"{v.max():.4g}", f"{v[-1]:.4g}", typeset_unit(run.trace.units[n]))
        for n, v in run.trace.signals.items()
    ]
    show_table("Signals", ("name", "smallest", "largest", "last", "unit"), signals)
    click.echo(f"written: {out}, {len(run.time)} rows {1e3 * run.step:g} ms apart")


def _pairs(option: str, given: tuple[str, ...], read: Callable[[str], T]) -> dict[str, T]:
    values: dict[str, T] = {}
    for text in given:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not (name and sign and value):
            raise ValueRangeError(f"{option} '{text}'", "is not NAME=VALUE", next_step="write NAME=VALUE")
        if name in values:
            raise ValueRangeError(f"{option} '{text}'", f"'{name}' is given twice", next_step="remove one")
        try:
            values[name] = read(value)
        except ValueError:
            hint = "give a number, or for an input amplitude@frequency in Hz, for instance 1.5@2"
            raise ValueRangeError(f"{option} '{text}'", f"'{value}' cannot be read", next_step=hint) from None
    return values


def _source(text: str) -> str:
    from ..export import Late

    return Late(text.removeprefix(_LATE)) if text.startswith(_LATE) else text


def _signal(text: str) -> Sine:
    from ..simulation import Sine

    size, at, frequency = text.partition("@")
    return Sine(float(size), float(frequency)) if at else Sine(0.0, 0.0, float(size))
