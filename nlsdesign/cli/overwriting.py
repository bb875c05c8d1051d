"""``--out`` with ``--force`` and ``--dry-run``: nothing is replaced that somebody has changed or brought."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import click

from ..foundation.errors import ValueRangeError
from ..foundation.text_files import WORDS, file_state, keeping, listed_files, refuse_to_lose
from .output import show_json
from .typed_values import NamedPath

F = TypeVar("F", bound=Callable[..., Any])
Names: TypeAlias = Iterable[str] | Callable[[Mapping[str, Any]], Iterable[str]]
"""Names of files or suffixes, or what gives them from the options of a command."""

force_option = click.option(
    "--force", is_flag=True, help="Replace files that were changed, or that nlsdesign has not written."
)
dry_run_option = click.option(
    "--dry-run", is_flag=True, help="Only list what would be written or replaced; exit status 1 if a file "
    "would be refused."
)  # fmt: skip


def out_option(default: str = "out", *, writes: Names = ()) -> Callable[[F], F]:
    """Return the option ``--out`` for a folder, with ``--force`` and ``--dry-run``.

    ``writes``: files that the command writes there, so far as their names are known beforehand. Those that an
    earlier run has listed there are looked at too where none is named.
    """
    kind = NamedPath(file_okay=False)
    text = "Folder for all files that are written."
    option = click.option(
        "--out", type=kind, default=default, show_default=True, help=text, callback=can_be_made
    )

    def below(given: Mapping[str, Any]) -> tuple[Path, list[Path]]:
        folder: Path = given["out"]
        names = list(writes(given) if callable(writes) else writes)
        return folder, [folder / name for name in names] or listed_files(folder)

    return _guarded(option, below)


def out_file_option(
    default: str | None, text: str, *, beside: Names = (), ending: str = ""
) -> Callable[[F], F]:
    """Return the option ``--out`` for a file, with ``--force`` and ``--dry-run``.

    A file of that name that another command has written is not replaced without ``--force``.

    ``default``: file if none is given; ``None`` where it must be given.
    """
    kind = NamedPath(dir_okay=False, example=default or f"my{ending or '.toml'}")
    shown: dict[str, Any] = {"default": default, "show_default": True} if default else {"required": True}
    check = functools.partial(_file_can_be_made, ending=ending)
    option = click.option("--out", type=kind, help=text, callback=check, **shown)

    def files(given: Mapping[str, Any]) -> tuple[Path, list[Path]]:
        out: Path = given["out"]
        suffixes = beside(given) if callable(beside) else beside
        return out.parent, [out, *(out.with_suffix(each) for each in suffixes)]

    return _guarded(option, files, only_own=True)


def _guarded(
    option: Callable[[Any], Any],
    files: Callable[[Mapping[str, Any]], tuple[Path, list[Path]]],
    *,
    only_own: bool = False,
) -> Callable[[F], F]:
    def decorate(command: F) -> F:
        @functools.wraps(command)
        def guarded(*words: Any, **given: Any) -> Any:
            force, dry_run = given.pop("force"), given.pop("dry_run")
            only_asked = click.get_current_context().invoked_subcommand is not None or given.get("listed")
            if only_asked:
                return command(*words, **given)
            folder, paths = files(given)
            if dry_run:
                as_json = given.get("as_json", False)
                return list_files(paths, folder, as_json=as_json, only_own=only_own)
            with kept(folder, paths, force=force, only_own=only_own):
                return command(*words, **given)

        result: F = option(force_option(dry_run_option(guarded)))
        return result

    return decorate


def c_names(name: str) -> tuple[str, str, str]:
    """Return the files of an export as C."""
    return f"{name}.h", f"{name}.c", f"{name}_selftest.c"


@contextmanager
def kept(
    folder: Path, paths: Iterable[Path], *, force: bool = False, only_own: bool = False
) -> Iterator[None]:
    """Refuse at once what would be lost, and say at the end what was written beside."""
    command = _command()
    if not force:
        refuse_to_lose(paths, command=command if only_own else "")
    with keeping(folder, force=force, command=command) as done:
        try:
            yield
        finally:
            for target, place in done.beside.items():
                words = f"{target} {WORDS[file_state(target)]} and was kept; the new one is {place}"
                click.echo(f"warning: {words}", err=True)


def _command() -> str:
    """Return the name of the command that runs, none outside of commands."""
    context = click.get_current_context(silent=True)
    return "" if context is None else context.info_name or ""


def list_files(paths: Iterable[Path], folder: Path, *, as_json: bool, only_own: bool = False) -> None:
    """Print what would be written or replaced, and end with status 1 if a file would be refused."""
    command = _command() if only_own else ""
    states = {path: file_state(path, command=command) for path in paths}
    refused = [path for path, state in states.items() if state not in ("new", "as written")]
    if as_json:
        show_json({"folder": folder, "files": {str(p): s for p, s in states.items()}, "refused": refused})
    else:
        for path, state in states.items():
            verb = {"new": "write", "as written": "replace"}.get(state, "refuse to replace")
            click.echo(f"would {verb}: {path}, which {WORDS[state]}")
        if not states:
            click.echo(f"the names of the files in {folder} are not known before the work")
    sys.exit(1 if refused else 0)


def can_be_made(_: click.Context, __: click.Parameter, folder: Path | None) -> Path | None:
    """Refuse, before any work, a folder that could not be written into; it is made with its first file."""
    if folder is None:
        return None
    try:
        place = next(each for each in (folder, *folder.absolute().parents) if each.exists())
    except OSError as error:
        raise click.BadParameter(f"{folder} cannot be made: {error.strerror}") from None
    if not place.is_dir():
        raise click.BadParameter(f"{folder} cannot be made: {place} is a file")
    if not os.access(place, os.W_OK | os.X_OK):
        raise click.BadParameter(f"{folder} cannot be made: {place} is not writable")
    return folder


def _file_can_be_made(
    context: click.Context, parameter: click.Parameter, file: Path | None, *, ending: str = ""
) -> Path | None:
    """Refuse, before any work, a file whose folder could not be written into, or of another ending."""
    if file is not None:
        if not file.name:
            raise click.BadParameter(f"'{file}' is the name of no file; name one")
        if ending and file.suffix.lower() != ending:
            step = f"name it {file.with_suffix(ending).name}"
            raise ValueRangeError(f"--out {file}", f"must end in {ending}", next_step=step)
        can_be_made(context, parameter, file.parent)
    return file
