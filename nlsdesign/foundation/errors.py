"""Errors that name the thing, the rule, the nearest valid name and the next step.

A command as somebody types it: words with blanks or special characters are quoted for the shell.
"""

from __future__ import annotations

import difflib
import os
import re
import shlex
import subprocess
from collections.abc import Iterable

_LONGEST_NAME = 120
"""Longer names are compared with nothing: no name that exists is as long."""
_LONGEST_RUN, _LONGEST_TEXT = 300, 2500
"""Most characters of a run without blanks, and of a text; what is longer is cut in its middle."""
_UNSEEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""Control characters, halves of characters, and marks that turn the direction of writing."""


def visible(text: str) -> str:
    r"""Return a text whose control characters are written out, so that it does nothing to a terminal.

    Line ends and tabs stay; escapes, carriage returns and marks that turn the direction of writing do not.

    Parameters
    ----------
    text
        From a file or a command line.

    Examples
    --------
    >>> print(visible("red \x1b[31m"))
    red \x1b[31m
    """
    return _UNSEEN.sub(lambda each: _code(each[0]), text)


def _code(character: str) -> str:
    number = ord(character)
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}"


def nearest(name: str, valid: Iterable[str]) -> str | None:
    """Return the valid name closest to ``name``, or ``None`` when nothing is close.

    Parameters
    ----------
    name
        The name as it was given.
    valid
        The names that would have been accepted.
    """
    candidates = list(valid)
    if len(name) > _LONGEST_NAME:
        return None
    for candidate in candidates:
        if candidate.lower() == name.lower():
            return candidate
    matches = difflib.get_close_matches(name, candidates, n=1, cutoff=0.5)
    if matches:
        return matches[0]
    last = name.rsplit(".", 1)[-1]
    tails = {candidate.rsplit(".", 1)[-1]: candidate for candidate in candidates}
    matches = difflib.get_close_matches(last, list(tails), n=1, cutoff=0.6)
    return tails[matches[0]] if matches else None


class NlsError(Exception):
    """Base of every error that a user can cause and correct.

    Parameters
    ----------
    thing
        What is wrong: file, line, column, field, part or signal.
    rule
        The rule that it breaks.
    did_you_mean
        The nearest valid name, if there is one.
    next_step
        What the user can do about it.
    """

    def __init__(
        self, thing: str, rule: str, *, did_you_mean: str | None = None, next_step: str | None = None
    ) -> None:
        self.thing = thing
        self.rule = rule
        self.did_you_mean = did_you_mean
        self.next_step = next_step
        text = f"{fit_for_message(self.thing)}: {fit_for_message(self.rule)}"
        if self.did_you_mean:
            text += f"; did you mean '{fit_for_message(self.did_you_mean)}'?"
        if self.next_step:
            text += f" -> {fit_for_message(self.next_step)}"
        super().__init__(text)

    def at(self, place: str) -> NlsError:
        """Return the same error with the place in front of the thing.

        Parameters
        ----------
        place
            For instance ``"deck.toml:12:1: spring.rubber.area"``.
        """
        return _rebuild(type(self), f"{place}: {self.thing}", self.rule, self.did_you_mean, self.next_step)

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuild, (type(self), self.thing, self.rule, self.did_you_mean, self.next_step)


def fit_for_message(text: str) -> str:
    r"""Return a text with control characters written out, and cut where it is very long.

    Parameters
    ----------
    text
        Holds names and numbers as somebody wrote them, who may not mean well.

    Examples
    --------
    >>> print(fit_for_message("motor\x1b[2J"))
    motor\x1b[2J
    """
    if len(text) > _LONGEST_TEXT:
        text = _cut(text, _LONGEST_TEXT)
    return re.sub(rf"\S{{{_LONGEST_RUN},}}", lambda run: _cut(run[0], _LONGEST_RUN), visible(text))


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: 2 * length // 3]}...{text[-length // 4 :]}"


def brief(value: object) -> str:
    """Return a value as Python writes it, for a message; a long one is cut.

    Parameters
    ----------
    value
        As read from a file.
    """
    try:
        return _cut(repr(value), _LONGEST_RUN)
    except ValueError:  # a whole number of more digits than Python writes
        return "a number of thousands of digits"


def _rebuild(
    kind: type[NlsError], thing: str, rule: str, did_you_mean: str | None, next_step: str | None
) -> NlsError:
    return kind(thing, rule, did_you_mean=did_you_mean, next_step=next_step)


class UnitError(NlsError):
    """A unit is missing, unknown, or of the wrong dimension."""


class ValueRangeError(NlsError):
    """A number lies outside the range of the law or the field."""


class UnknownNameError(NlsError):
    """A field, part, signal, component or study of that name does not exist."""


class DeckError(NlsError):
    """A deck cannot be read as it stands."""


class ArrangementError(NlsError):
    """Parts are connected in a way that has no (unique) solution."""


class InfeasibleError(NlsError):
    """Limits contradict each other or the target."""


class MeasurementError(NlsError):
    """A record cannot be used as it stands."""


class MissingLibraryError(NlsError):
    """An optional library is not installed."""


class ConvergenceError(NlsError):
    """A solver stopped without a solution; no number is returned."""


class WorkSharingError(NlsError):
    """Workers, or the scheduler that gives them work, cannot be used."""


class ExportError(NlsError):
    """A file could not be written, or generated code not compiled or loaded."""


def unknown_name(kind: str, name: str, valid: Iterable[str]) -> UnknownNameError:
    """Return the error for a name that does not exist, with the nearest that does.

    Parameters
    ----------
    kind
        What was looked up, for instance ``"parameter"``.
    name
        The name as given.
    valid
        All names that exist.
    """
    names = sorted(valid)
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return UnknownNameError(
        f"{kind} '{name}'",
        "no such name",
        did_you_mean=nearest(name, names),
        next_step=f"use one of: {shown}" if names else None,
    )


def missing_library(what: str, library: str, extra: str) -> MissingLibraryError:
    """Return the error for a library that is not installed, with the command that installs it.

    Parameters
    ----------
    what
        Needs the library.
    library
        Name of the module.
    extra
        Extra of the package that brings it.
    """
    return MissingLibraryError(
        what, f"needs {library}, which is not installed", next_step=f"pip install 'nlsdesign[{extra}]'"
    )


def typed_command(*words: object) -> str:
    """Return words as one line that can be copied into a shell.

    Parameters
    ----------
    words
        Of the command, each unquoted.

    Examples
    --------
    >>> typed_command("nlsdesign", "deck", "check", "my leg.toml")
    "nlsdesign deck check 'my leg.toml'"
    """
    texts = [str(item) for item in words]
    # The shells of Windows know double quotes only.
    return subprocess.list2cmdline(texts) if os.name == "nt" else shlex.join(texts)
