"""Files and folders as options and arguments; an empty name, which would be the current one, is refused."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..foundation.errors import ValueRangeError

if TYPE_CHECKING:
    _Kind = click.Path[Path]
else:
    _Kind = click.Path


class NamedPath(_Kind):
    """A path with a name; gives a :class:`~pathlib.Path`.

    A variable of the shell that is not set gives an empty text, which Python reads as the current folder:
    files would be written where nobody looks for them, or whatever is there would be read.

    Parameters
    ----------
    file_okay, dir_okay
        Whether it may be a file, or a folder.
    exists
        Whether it must be there.
    example
        A name for the message, where the option has no usual one.
    """

    def __init__(
        self, *, file_okay: bool = True, dir_okay: bool = True, exists: bool = False, example: str = ""
    ) -> None:
        super().__init__(exists=exists, file_okay=file_okay, dir_okay=dir_okay, path_type=Path)
        self._example = example

    def convert(
        self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        """Return the path."""
        if not os.fspath(value).strip():
            raise self._nameless(str(value), param)
        path: Path = super().convert(value, param, ctx)
        return path

    def _nameless(self, value: str, param: click.Parameter | None) -> ValueRangeError:
        """Return the error that names the option or argument, the rule and an example."""
        what = "folder" if not self.file_okay else "file" if not self.dir_okay else "file or folder"
        name = "" if param is None else param.opts[0] if isinstance(param, click.Option) else _shown(param)
        usual = param.default if param is not None and isinstance(param.default, str) else ""
        example = self._example or usual or f"my_{what.partition(' ')[0]}"
        words = f"{name} {example}" if name.startswith("-") else example
        step = f"write for instance {words}" + (", or '.' for the current folder" if self.dir_okay else "")
        return ValueRangeError(f"{name} '{value}'".lstrip(), f"names no {what}", next_step=step)


def _shown(param: click.Parameter) -> str:
    return param.metavar or (param.name or "").upper()
