"""Reading the fixed shells and writing results whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path

from ..errors import ExportError


def shell(name: str) -> str:
    """Return the text of a fixed shell.

    Parameters
    ----------
    name
        File name in ``nlsdesign/export/shells``.
    """
    return (files(__package__) / "shells" / name).read_text(encoding="utf-8")


def filled(name: str, words: Mapping[str, str]) -> str:
    """Return a shell with its ``@word@`` marks replaced.

    Parameters
    ----------
    name
        File name in ``nlsdesign/export/shells``.
    words
        Replacement by word.
    """
    text = shell(name)
    for word, replacement in words.items():
        text = text.replace(f"@{word}@", replacement)
    return text


@contextmanager
def draft(target: Path) -> Iterator[Path]:
    """Give a temporary sibling to write to; it takes the place of the target when all went well.

    Parameters
    ----------
    target
        Final path; its folder is made if it is missing.

    Raises
    ------
    ExportError
        If the folder or file cannot be written.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:
        raise _not_writable(target, error) from error
    os.close(handle)
    try:
        yield Path(name)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except OSError as error:
        raise _not_writable(target, error) from error
    finally:
        Path(name).unlink(missing_ok=True)


def write_all(texts: Mapping[Path, str]) -> None:
    """Write several files; none is touched before all of them could be written beside their place.

    Parameters
    ----------
    texts
        Content by path.
    """
    if not texts:
        return
    (path, text), *rest = texts.items()
    with draft(path) as name:
        name.write_text(text, encoding="utf-8", newline="\n")
        write_all(dict(rest))


def _not_writable(target: Path, error: OSError) -> ExportError:
    return ExportError(
        str(target), f"cannot be written ({error.strerror})", next_step="name another file or folder"
    )
