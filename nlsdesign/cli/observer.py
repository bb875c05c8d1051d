"""``nlsdesign observer``: the torque observer as C; sub-commands stand in modules of their own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from .observer_certificate import CERTIFICATE, given_ranges, range_options
from .observer_kinds import CASCADE, CERTIFIED, kind_option
from .output import DECK_HELP, examples, json_option, measured_option, show_json, spring_option
from .overwriting import c_names, out_option
from .range_remarks import range_remarks, warn
from .units import Number

sample_time_option = click.option(
    "--sample-time", type=Number("ms", above=0.0, up_to=1.0), default="1 ms", show_default=True,
    help="Of what is computed in steps.",
)  # fmt: skip
real_option = click.option(
    "--real",
    type=click.Choice(["double", "float"]),
    default="double",
    show_default=True,
    help="Type of the numbers in C.",
)


def _writes(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files that the options ask for."""
    proved = [CERTIFICATE] if given["certified"] or given["kind"] == CERTIFIED else []
    compared = ["errors.csv", "errors.json", "errors.svg", "report.html"] if given["with_errors"] else []
    return [*proved, *c_names("observer"), *compared]


@click.group(
    invoke_without_command=True,
    epilog=examples(
        "nlsdesign observer --deck austin2015_figure_consistent",
        "nlsdesign observer --deck austin2015_figure_consistent --kind cascade --real float --json",
        "nlsdesign observer --deck austin2015_figure_consistent --errors --draws 32",
    ),
)
@click.pass_context
@click.option("--deck", "deck_name", metavar="DECK", help=DECK_HELP)
@sample_time_option
@spring_option
@measured_option
@kind_option
@out_option("out/observer", writes=_writes)
@real_option
@click.option("--errors", "with_errors", is_flag=True, help="Also compare torque errors on a simulated "
              "bench: with exact numbers, over the spread, by cause.")  # fmt: skip
@click.option("--draws", type=click.IntRange(min=4), default=16, show_default=True,
              help="Machines drawn for --errors.")  # fmt: skip
@json_option
@click.option("--certificate", "certified", is_flag=True, help="Also write what is proved of it.")
@click.option("--decay", type=float, metavar="PER_SECOND", help="Design one certified gain with this decay.")
@click.option("--with-spread", is_flag=True, help="Certify for all parameters within their spread.")
@range_options
def observer(
    context: click.Context, /, deck_name: str | None, out: Path, as_json: bool, **options: Any
) -> None:
    """Design the torque observer and write it as C with a self-test.

    Without --kind it is the observer with the least expected error over the spread of the deck; the same that
    `export c` and `export fmu` write. The reason is printed.
    """
    if context.invoked_subcommand is not None:
        _refuse_misplaced(context)
        return
    if deck_name is None:
        raise click.MissingParameter(ctx=context, param_type="option", param_hint="'--deck'")
    from ..components.assembly.deck_writer import declare
    from ..export import export_c, quickest
    from ..feedback.observer import certified_design, designed_observer, errors_beside
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps
    from ..model import flatten
    from .observer_spread import show_errors, write_errors

    drawn = context.get_parameter_source("draws") is not click.core.ParameterSource.DEFAULT
    if drawn and not options["with_errors"]:
        raise click.UsageError("--draws belongs to --errors; add it, or leave --draws out", ctx=context)
    kind, wanted = _what_is_asked(context, options)
    deck = load_deck(deck_name)
    declared = declare(deck)
    plant = flatten(declared)
    roles = {name: options[name] for name in ("spring", "measured")}
    sample_time, real = options["sample_time"], options["real"]
    steps = Steps()
    with steps.step("observer"):
        chosen = designed_observer(plant, kind=kind, decay=options["decay"], sample_time=sample_time, **roles)
        text = (deck.name, deck.path.read_text(encoding="utf-8-sig"))
        proved = None if wanted is None else chosen.certify(plant, deck=text, **wanted)
    errors = None
    if options["with_errors"]:
        with steps.step("errors over the spread"):
            errors = errors_beside(
                plant, chosen, draws=options["draws"], sample_time=sample_time, translate=quickest(), **roles
            )
    model = chosen.model if proved is None else proved.stated(certified_design(proved, plant).model)
    source = export_c(model, out, real=real, name="observer")
    files = [source.header, source.source, source.selftest]
    if proved is not None:
        files.insert(0, proved.write_beside(source.header, source.source))
    statement = () if proved is None else proved.statement
    remarks = range_remarks(declared, measured=options["measured"])
    warn(remarks)
    words = (str(chosen.design), *filter(None, [chosen.reason]), *statement)
    if errors is not None:
        files += write_errors(errors, out, model=model, words=words, files=files)
    if as_json:
        content = {
            "kind": chosen.kind, "reason": chosen.reason, "expected_rms": list(chosen.expected),
            "description": model.description, "statement": list(statement),
            "certified": proved is not None, "warnings": remarks, "files": files,
        }  # fmt: skip
        show_json(content | ({} if errors is None else {"errors": errors.content()}))
        return
    for sentence in words:
        click.echo(sentence)
    if proved is None:
        click.echo("not certified; --kind certified or --certificate proves what can be proved")
    if errors is not None:
        show_errors(errors, chosen.kind, deck_name)
    else:
        click.echo("errors over the spread, and their causes: add --errors")
    click.echo(f"written: {', '.join(map(str, files))}")


def _what_is_asked(
    context: click.Context, options: dict[str, Any]
) -> tuple[str | None, dict[str, Any] | None]:
    """Return the kind of observer, and what is to be proved of it; nothing by default."""
    ranges = given_ranges(options)
    kind, decay, with_spread = options["kind"], options["decay"], options["with_spread"]
    if not (options["certified"] or kind == CERTIFIED):
        if decay is not None or with_spread or ranges:
            words = "--decay, --with-spread, --angles, --speed and --angle-error belong to --certificate"
            raise click.UsageError(words, ctx=context)
        return kind, None
    if kind not in (None, CASCADE, CERTIFIED):
        raise click.UsageError(
            f"an observer of kind '{kind}' cannot be certified; take --kind {CERTIFIED} or {CASCADE}",
            ctx=context,
        )
    if decay is not None and kind == CASCADE:
        raise click.UsageError(f"--decay belongs to --kind {CERTIFIED}", ctx=context)
    kind = kind or (CASCADE if decay is None else CERTIFIED)
    return kind, {"decay": decay, "with_spread": with_spread, "real": options["real"], "ranges": ranges}


def _refuse_misplaced(context: click.Context) -> None:
    """Refuse options before the name of a sub-command, which would be read by nobody."""
    for parameter in context.command.params:
        source = context.get_parameter_source(parameter.name or "")
        if source is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(
                f"{parameter.opts[0]} stands before '{context.invoked_subcommand}'; "
                "options of a sub-command stand behind its name",
                ctx=context,
            )
