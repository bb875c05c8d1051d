"""``nlsdesign observer``: the torque observer as C, its errors over the spread, and what is proved of it."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.quantity import typeset_unit
from ..foundation.written_numbers import shared_prefix, without_power
from .options import (
    CASCADE,
    CERTIFIED,
    DECK_HELP,
    deck_option,
    hold_out_option,
    json_option,
    kind_option,
    mapping_option,
    measured_option,
    real_option,
    sample_time_option,
    spring_option,
)
from .output import examples, next_command, show_json, show_lines, show_table, show_written, warn
from .overwriting import c_names, out_option
from .typed_values import NamedPath, Number

if TYPE_CHECKING:
    from ..feedback.observer import SpreadErrors
    from ..model import FlatModel
    from ..regeneration import FittedPoles

CERTIFICATE = "certificate.json"
"""File that is announced; the library is not loaded for it."""
SEARCHES = ("gradient", "cma")
"""As :data:`nlsdesign.regeneration.fitted_poles.SEARCHES`, which is not loaded for an option."""


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
        "nlsdesign observer --deck my.toml --kind published --fit-poles bench",
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
              "bench: over the spread, with exact numbers, by cause.")  # fmt: skip
@click.option("--draws", type=click.IntRange(min=4), default=16, show_default=True,
              help="Machines drawn for --errors.")  # fmt: skip
@click.option("--fit-poles", "records", type=NamedPath(example="bench"), default=None,
              help="Folder of records to which the poles of --kind published are fitted.")  # fmt: skip
@click.option("--fit-poles-by", "by", type=click.Choice(SEARCHES), default=SEARCHES[0], show_default=True,
              help="Exact slopes, or CMA-ES as a yardstick.")  # fmt: skip
@hold_out_option
@mapping_option
@json_option
@click.option("--certificate", "certified", is_flag=True, help="Also write what is proved of it.")
@click.option("--decay", type=float, metavar="PER_SECOND", help="Design one certified gain with this decay.")
@click.option("--with-spread", is_flag=True, help="Certify for all parameters within their spread.")
@click.option(
    "--angles",
    type=Number("rad"),
    nargs=2,
    metavar="LOW HIGH",
    help="Range of the angle over "
    "which a bound on the torque is to hold, such as --angles '-46 deg' '46 deg'; the whole table "
    "by default.",
)
@click.option("--speed", type=Number("rad/s"), help="Largest speed; 20 rad/s by default.")
@click.option("--angle-error", type=Number("rad"), help="Largest error of the measured angle; half a count "
              "of the deck's encoder by default.")  # fmt: skip
def observer(
    context: click.Context, /, deck_name: str | None, out: Path, as_json: bool, **options: Any
) -> None:
    """Design the torque observer and write it as C. A self-test is written beside it.

    Without --kind it is the observer with the least expected error over the spread of the deck; the same that
    `export c` and `export fmu` write. The reason is printed.
    """
    if context.invoked_subcommand is not None:
        _refuse_misplaced(context)
        return
    if deck_name is None:
        raise click.MissingParameter(ctx=context, param_type="option", param_hint="'--deck'")
    from ..components import declare
    from ..export import export_c, quickest
    from ..feedback.observer import (
        certified_design,
        designed_observer,
        errors_beside,
        with_innovation_alarm,
    )
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps
    from ..model import flatten
    from ..regeneration import range_remarks

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
        fitted = _fitted(plant, {**options, "sample_time": sample_time})
        chosen = fitted.observer if fitted else designed_observer(
            plant, kind=kind, decay=options["decay"], sample_time=sample_time, **roles
        )  # fmt: skip
        text = (deck.name, deck.path.read_text(encoding="utf-8-sig"))
        proved = None if wanted is None else chosen.certify(plant, deck=text, **wanted)
    errors = None
    if options["with_errors"]:
        with steps.step("errors over the spread"):
            errors = errors_beside(
                plant, chosen, draws=options["draws"], sample_time=sample_time, translate=quickest(), **roles
            )
    model = chosen.model
    if proved is not None:
        model = proved.stated(with_innovation_alarm(certified_design(proved, plant).model, plant))
    source = export_c(model, out, real=real, name="observer")
    files = [source.header, source.source, source.selftest]
    if proved is not None:
        files.insert(0, proved.write_beside(source.header, source.source))
    statement = () if proved is None else proved.statement
    remarks = [*range_remarks(declared, measured=options["measured"]), *(fitted.remarks if fitted else ())]
    warn(remarks)
    sentences = (str(chosen.design), *filter(None, [chosen.reason]), *statement)
    if errors is not None:
        files += write_errors(errors, out, model=model, words=sentences, files=files)
    if as_json:
        content = {
            "kind": chosen.kind, "reason": chosen.reason, "expected_rms": list(chosen.expected),
            "description": model.description, "statement": list(statement),
            "certified": proved is not None, "warnings": remarks, "files": files,
        }  # fmt: skip
        content |= {} if fitted is None else {"fitted_poles": fitted.content()}
        show_json(content | ({} if errors is None else {"errors": errors.content()}))
        return
    show_lines(sentences)
    if fitted is not None:
        show_table(*fitted.shown())
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
    ranges = {n: options[n] for n in ("angles", "speed", "angle_error") if options[n] is not None}
    kind, decay, with_spread = options["kind"], options["decay"], options["with_spread"]
    if options["records"] is not None and kind != "published":
        raise click.UsageError("--fit-poles belongs to --kind published", ctx=context)
    if options["records"] is None and (
        options["mapping"] or options["hold_out"] or options["by"] != SEARCHES[0]
    ):
        raise click.UsageError("--fit-poles-by, --mapping and --hold-out belong to --fit-poles", ctx=context)
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


def _fitted(plant: FlatModel, options: Mapping[str, Any]) -> FittedPoles | None:
    """Return the published observer with poles fitted to records; nothing where none are named."""
    from ..bench.identification import load_records
    from ..regeneration import ObserverChoice, fit_poles

    if options["records"] is None:
        return None
    reading = {name: options[name] for name in ("mapping", "hold_out")}
    choice = ObserverChoice(**{name: options[name] for name in ("sample_time", "spring", "measured")})
    records = load_records(options["records"], plant, **reading)
    return fit_poles(plant, records, choice=choice, by=options["by"])


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


CAUSES = 8
"""Rows of the table of causes."""


def write_errors(
    errors: SpreadErrors, out: Path, *, model: FlatModel, words: Sequence[str], files: Sequence[Path]
) -> list[Path]:
    """Write the errors as table, JSON, figure and page.

    ``files``: written before; the page lists them too.
    """
    from ..presentation import figures
    from ..presentation.report import write_observer_report

    written = [
        *errors.write(out),
        *figures.write_figures(out, {"errors": figures.errors_over_spread(errors)}),
    ]
    page = out / "report.html"
    return [*written, write_observer_report(page, model, errors, words=words, files=[*files, *written])]


def show_errors(errors: SpreadErrors, kind: str, deck_name: str) -> None:
    """Print both tables, and where the way goes on."""
    unit, causes = typeset_unit(errors.unit), errors.ranked_causes(kind)[:CAUSES]
    factor, shown = shared_prefix([size for _, size in causes], errors.unit)
    title = (
        f"Torque error in {errors.shown_in} rms, sines of {errors.torque:.3g} {unit}, "
        f"{errors.drawn.shape[1]} draws of the spread"
    )
    heads = ("observer", "Hz", "median", "90 %", "rms", "bound on rms", "exact numbers")
    show_table(title, heads, errors.rows())
    ranked = [[name, without_power(factor * size)] for name, size in causes]
    show_table("Causes", (f"{kind}: cause, one standard deviation off", f"{shown} rms"), ranked)
    if errors.lost:
        click.echo(f"{errors.lost} drawn machines do not run and are in no figure")
    if len(errors.bound):
        click.echo(
            "the bound is on the rms over all machines within the spread, for any estimator with these "
            "sensors; a few draws scatter about it"
        )
    click.echo(f"least over the spread: {errors.best}")
    following = next_command("observer", "calibrate", "--deck", deck_name, "--plan")
    click.echo(f"what a calibration would buy: {following}")


@observer.command(
    "verify",
    epilog=examples(
        "nlsdesign observer verify out/observer/certificate.json",
        "nlsdesign observer verify out/observer/certificate.json --deck my.toml --c out/observer --json",
    ),
)
@click.argument("certificate", type=NamedPath(dir_okay=False, example="out/observer/certificate.json"))
@click.option("--deck", "deck_name", metavar="DECK", help="Deck that should be the certified one.")
@click.option(
    "--c",
    "code",
    type=NamedPath(file_okay=False),
    help="Folder of the C files; they are written anew from the deck and compared.",
)
@json_option
def verify_certificate(certificate: Path, deck_name: str | None, code: Path | None, as_json: bool) -> None:
    """Check a certificate again, without the solver. Exit status 1 where it does not hold."""
    from ..components import declare
    from ..export import export_c
    from ..feedback.observer import CodeToCompare, read_certificate, verify, with_innovation_alarm
    from ..foundation.deck import load_deck, read_deck
    from ..model import flatten

    proved, untouched = read_certificate(certificate)
    given = load_deck(deck_name).path.read_text(encoding="utf-8-sig") if deck_name else None
    name, text = proved.deck
    model = flatten(declare(read_deck(text, Path(f"{name}.toml")))) if text else None

    def written(observer: FlatModel, *given: Any, **named: Any) -> object:
        return export_c(
            observer if model is None else with_innovation_alarm(observer, model), *given, **named
        )

    result = verify(
        proved, untouched=untouched, model=model, deck=given,
        code=None if code is None else CodeToCompare(code, written),
    )  # fmt: skip
    if as_json:
        checks = [{"name": c.name, "holds": c.holds, "detail": c.detail} for c in result.checks]
        show_json({"holds": result.holds, "statement": list(proved.statement), "checks": checks})
    else:
        show_lines(proved.statement)
        click.echo(str(result))
        click.echo("the certificate holds" if result.holds else "the certificate DOES NOT HOLD")
    if not result.holds:
        sys.exit(1)


@observer.command(
    "certify-continuous",
    epilog=examples(
        "nlsdesign observer certify-continuous --deck austin2015_figure_consistent",
        "nlsdesign observer certify-continuous --deck austin2015_figure_consistent --published "
        "--angles '-40 deg' '40 deg'",
    ),
)
@deck_option
@spring_option
@measured_option
@out_option("out/observer", writes=(CERTIFICATE,))
@click.option("--published", is_flag=True, help="States of Austin et al. 2015 instead of the minimal ones.")
@click.option("--decay", type=float, metavar="PER_SECOND", help="As fast as can be proved by default.")
@click.option("--condition", type=float, default=100.0, show_default=True, help="Largest condition of P.")
@click.option(
    "--angles", type=Number("rad"), nargs=2, metavar="LOW HIGH", help="The whole contour by default."
)
@json_option
def certify_continuous_gain(
    deck_name: str,
    out: Path,
    published: bool,
    angles: tuple[float, float] | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Prove one gain in continuous time. The proof says that every error vanishes."""
    from ..components import declare
    from ..feedback.observer import Minimal, PaperForm, certify_continuous, write_certificate
    from ..foundation.deck import load_deck
    from ..model import flatten, measured_motion, series_spring

    deck = load_deck(deck_name)
    plant = flatten(declare(deck))
    proved = certify_continuous(
        plant, estimate=series_spring(plant, options["spring"]).effort,
        measured=measured_motion(plant, options["measured"]), form=PaperForm() if published else Minimal(),
        decay=options["decay"], condition=options["condition"], angles=angles,
    )  # fmt: skip
    proved = replace(proved, deck=(deck.name, deck.path.read_text(encoding="utf-8-sig")))
    path = write_certificate(proved, out / CERTIFICATE)
    gains = dict(zip(proved.proof.system.states, proved.proof.gain, strict=True))
    rows = [f"gain of {name}: {', '.join(f'{v:.7g}' for v in row)}" for name, row in gains.items()]
    show_written(as_json, (*proved.statement, *rows), [path], gains=gains)
