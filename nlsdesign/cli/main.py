"""The program: status 0 done, 1 a finding, 2 bad input, 70 a fault, 130 interrupted, 141 output closed."""

from __future__ import annotations

import re
import sys

import click

from ..foundation.errors import NlsError, nearest
from ..foundation.locations import version
from .analyse import analyse
from .analyse_angle import analyse_angle
from .analyse_loop import loop
from .calibrate import calibrate
from .compare import compare
from .completion import COMPLETE, complete_names, completion
from .cosimulate import cosimulation
from .decks import deck
from .design import design
from .diagnose import diagnose
from .docs import docs
from .export import export
from .export_ssp import export_ssp
from .fit import fit
from .materials import materials
from .observer import observer
from .observer_certificate import verify_certificate
from .observer_proofs import certify_adaptive_estimate, certify_continuous_gain
from .output import examples
from .parts import parts
from .report import report
from .serve import serve
from .simulate import simulate
from .studies import study
from .sweep import sweep
from .unexpected import BROKEN_PIPE


@click.group(
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=examples(
        "nlsdesign deck list",
        "nlsdesign study run hello",
        "nlsdesign simulate --deck austin2015_soft_spring --input 'motor.current=2 A sine 2 Hz' --stop '1 s'",
    )
    + "\n\nExit status: 0 done, 1 a finding, 2 bad input, 130 interrupted.",
)
@click.version_option(version(), prog_name="nlsdesign")
@click.option(
    "--with",
    "packages",
    multiple=True,
    metavar="PACKAGE",
    help="Package or .py file with parts, effects and rubbers of your own; before the command; repeatable.",
)
@click.pass_context
def program(context: click.Context, packages: tuple[str, ...]) -> None:
    """Design workbench for series elastic actuators whose spring is a cam that stretches rubber."""
    if packages:
        from ..foundation.extensions import extended_by, load_extension

        context.with_resource(extended_by(*(load_extension(name) for name in packages)))


export.add_command(export_ssp)
for part in (calibrate, certify_adaptive_estimate, certify_continuous_gain, verify_certificate):
    observer.add_command(part)
for command in (
    *(parts, materials, deck, design, analyse, observer, export),
    *(sweep, report, cosimulation, simulate, fit, diagnose, compare, study, serve, completion, docs),
):
    program.add_command(command)
for analysis in (analyse_angle, loop):  # the first is the default
    analyse.add_command(analysis)
complete_names(program)


def _with_nearest(error: click.ClickException) -> click.ClickException:
    """Return an error that names the nearest valid name, where an option takes one of some names."""
    if not isinstance(error, click.BadParameter) or error.param is None:
        return error
    kind = error.param.type
    given = re.match(r"'(.*)' is not one of", error.message, re.DOTALL)
    if isinstance(kind, click.Choice) and given:
        near = nearest(given[1], map(str, kind.choices))
        words = error.message + (f" Did you mean '{near}'?" if near else "")
        return click.BadParameter(words, error.ctx, error.param, error.param_hint)
    return error


def main() -> None:
    """Run the command line; bad input ends with one message and exit status 2."""
    output = sys.stdout
    try:
        # Without its standalone mode click returns the exit status of a command instead of ending the run.
        status = program(standalone_mode=False, complete_var=COMPLETE)
        if isinstance(status, int) and status:
            sys.exit(status)
    except SystemExit:
        if sys.stdout is not output:
            # Whoever read the output has seen enough: click puts another one in its place and leaves with 1,
            # which would be a finding.
            sys.exit(BROKEN_PIPE)
        raise
    except click.exceptions.Exit as exit_:
        sys.exit(exit_.exit_code)
    except click.ClickException as error:
        _with_nearest(error).show()
        sys.exit(2)
    except (click.exceptions.Abort, KeyboardInterrupt):
        click.echo("interrupted", err=True)
        sys.exit(130)
    except NlsError as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(2)
    except Exception as error:
        from .unexpected import status_of

        sys.exit(status_of(error))
