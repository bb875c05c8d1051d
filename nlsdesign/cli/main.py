"""The program: status 0 done, 1 a finding, 2 bad input, 70 a fault, 130 interrupted, 141 output closed."""

from __future__ import annotations

import errno
import gc
import os
import platform
import re
import sys
import tempfile
import traceback

import click

from ..foundation.errors import NlsError, fit_for_message, nearest, typed_command
from ..foundation.locations import version
from ..foundation.processes import usual_temporary_folder, was_interrupted
from .analyse import analyse
from .bench import calibrate, diagnose, fit
from .compare import compare
from .completion import COMPLETE, complete_names, completion
from .cosimulate import cosimulation
from .decks import deck
from .describe import records
from .design import design
from .export import export
from .export_block import export_block as export_block
from .export_fmu import export_fmus as export_fmus
from .look_up import docs, materials, parts
from .observer import observer
from .output import examples
from .serve import serve
from .simulate import simulate
from .studies import study
from .sweep import report, sweep
from .watch import watch


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


observer.add_command(calibrate)
for command in (
    *(parts, materials, deck, design, analyse, observer, export),
    *(
        sweep,
        report,
        cosimulation,
        simulate,
        records,
        fit,
        diagnose,
        watch,
        compare,
        study,
        serve,
        completion,
        docs,
    ),
):
    program.add_command(command)
complete_names(program)


RETIRED = {"adaptive": "corrected"}
"""Names that options took once, and what has their place now."""


def _with_nearest(error: click.ClickException) -> click.ClickException:
    """Return an error that names the nearest valid name, where an option takes one of some names."""
    if not isinstance(error, click.BadParameter) or error.param is None:
        return error
    kind = error.param.type
    given = re.match(r"'(.*)' is not one of", error.message, re.DOTALL)
    if isinstance(kind, click.Choice) and given:
        near = RETIRED.get(given[1]) or nearest(given[1], map(str, kind.choices))
        help_line = f"{error.ctx.command_path} --help" if error.ctx else "--help"
        words = f"{error.message} " + (f"Did you mean '{near}'?" if near else f"'{help_line}' explains each.")
        return click.BadParameter(words, error.ctx, error.param, error.param_hint)
    return error


def main() -> None:
    """Run the command line; bad input ends with one message and exit status 2."""
    output = sys.stdout
    # What is imported stays: garbage is looked for after 100,000 new objects, not 700.
    gc.set_threshold(max(gc.get_threshold()[0], 100_000), 20, 50)
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
        sys.exit(status_of(error))


_ADVICE = {
    errno.ENAMETOOLONG: "give a shorter name",
    errno.ELOOP: "give a name that is no link to itself",
    errno.EACCES: "give a file that you may use",
    errno.EPERM: "give a file that you may use",
    errno.EROFS: "name a place that can be written",
    errno.ENOSPC: "make room for it",
    errno.EDQUOT: "make room for it",
    errno.EIO: "give a file on a device that works",
}
"""What the system refuses whatever the program does, and what helps."""
FAULT, BROKEN_PIPE, INTERRUPTED, BAD_INPUT = 70, 141, 130, 2


def status_of(error: Exception) -> int:
    """Tell the user of an error that no command has expected, and return the exit status."""
    if was_interrupted():
        click.echo("interrupted", err=True)
        return INTERRUPTED
    if isinstance(error, BrokenPipeError):
        # Whoever read the output has seen enough; nothing more may be written, at the very end neither.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    if isinstance(error, MemoryError):
        click.echo("error: there is not enough memory for this -> ask for less at once", err=True)
        return BAD_INPUT
    if isinstance(error, OSError) and error.errno in _ADVICE:
        name = fit_for_message(str(error.filename or "a file"))
        click.echo(f"error: {name}: {error.strerror} -> {_ADVICE[error.errno]}", err=True)
        return BAD_INPUT
    reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    click.echo(f"error: this is a fault of nlsdesign, not of your input ({reason})", err=True)
    click.echo(f"-> please report it together with {_written(error)}", err=True)
    return FAULT


def _written(error: Exception) -> str:
    """Write what a report of a fault needs, and return the name of the file."""
    lines = [
        f"nlsdesign {version()}, Python {platform.python_version()}, {platform.platform()}",
        typed_command("nlsdesign", *sys.argv[1:]),
        *traceback.format_exception(error),
    ]
    text = "\n".join(lines).encode("utf-8", "backslashreplace")
    try:
        handle, name = tempfile.mkstemp(".txt", "nlsdesign-fault-", usual_temporary_folder())
        with os.fdopen(handle, "wb") as file:
            file.write(text)
    except OSError:
        return "these lines:\n" + text.decode("utf-8")
    return name
