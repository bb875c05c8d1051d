"""``nlsdesign fit``: the declared numbers refitted to bench records."""

from __future__ import annotations

from pathlib import Path

import click

from ..quantity import typeset_unit
from .output import deck_option, json_option, out_option, show_json, show_table
from .units import Number

_file = click.Path(path_type=Path, dir_okay=False)


@click.command()
@deck_option
@click.option("--records", type=click.Path(path_type=Path), required=True, help="Folder of records.")
@click.option("--hold-out", multiple=True, help="Glob of record names that no fit may use; repeatable.")
@click.option("--mapping", type=_file, default=None, help="TOML that maps columns to signals.")
@click.option("--window", type=Number("s"), default=None,
              help="Simulate the whole model over windows instead, for instance '1 s'.")  # fmt: skip
@out_option("out/fit")
@json_option
def fit(
    deck_name: str,
    records: Path,
    hold_out: tuple[str, ...],
    mapping: Path | None,
    window: float | None,
    out: Path,
    as_json: bool,
) -> None:
    """Refit the numbers that the deck declares with a spread; nothing is added to the model."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck
    from ..discrepancy import refit, write_refit
    from ..identification import load_records
    from ..model import flatten
    from ..progress import Steps

    actuator = declare(load_deck(deck_name))
    measured = load_records(records, flatten(actuator), mapping=mapping, hold_out=hold_out)
    steps = Steps()
    with steps.step("fit"):
        result = refit(actuator, measured, window=window, progress=steps.note)
    file, deck = write_refit(result, out)
    if as_json:
        show_json(result.to_dict(str(deck)))
        return
    numbers = [
        (
            n.name,
            f"{n.declared:.4g}",
            f"{n.fitted:.4g} ± {n.standard_error:.2g}",
            typeset_unit(n.unit),
            f"{n.strain:+.2f}",
        )
        for n in result.numbers
    ]
    show_table("Numbers", ("name", "declared", "fitted", "unit", "change in spreads"), numbers)
    errors = [
        (e.block, e.role.replace("_", " "), *(f"{v:.3g}" for v in e[2:5]), typeset_unit(e.unit))
        for e in result.errors()
    ]
    show_table("Errors, rms", ("block", "records", "declared", "fitted", "noise floor", "unit"), errors)
    for sentence in result.words():
        click.echo(sentence)
    click.echo(f"written: {file} and {deck}; next: nlsdesign diagnose --deck {deck} --records {records}")
