"""``--workers``: how many processes of this machine share the long work of a command."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


def workers_option(command: F) -> F:
    """Return a command with the option ``--workers``; its results do not depend on it."""

    @functools.wraps(command)
    def shared(*words: Any, **given: Any) -> Any:
        from ..foundation.work_sharing import Processes, spread_over

        workers = given.pop("workers")
        with contextlib.nullcontext() if workers is None else spread_over(Processes(workers)):
            return command(*words, **given)

    option = click.option(
        "--workers", type=click.IntRange(min=1), default=None, metavar="NUMBER",
        help="Processes of this machine that share the work, by default one for each core, at most four; the "
        "result is the same.",
    )  # fmt: skip
    result: F = option(shared)  # type: ignore[assignment]
    return result
