"""What no command has expected: one message, and a file that holds what a report of it needs."""

from __future__ import annotations

import errno
import os
import platform
import sys
import tempfile
import traceback

import click

from ..foundation.command_words import typed_command
from ..foundation.errors import fit_for_message
from ..foundation.locations import version
from ..foundation.processes import usual_temporary_folder, was_interrupted

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
