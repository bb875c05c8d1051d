"""What other packages bring: laws, effects and rubbers of one's own, for as long as a block lasts."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import pkgutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import ModuleType
from typing import Final

from .errors import NlsError

_PRESENT: Final[ContextVar[tuple[ModuleType, ...]]] = ContextVar("extensions", default=())
_OF_A_FILE = "nlsdesign_extension_"
"""With which the name of a module of one file begins."""


@contextmanager
def extended_by(*packages: ModuleType) -> Iterator[None]:
    """Let decks name the parts of other packages, and the diagnosis try their effects, within a block.

    What a package brings is found as that of this package is, by being there: each public class of a part,
    each row of a catalogue (:class:`~nlsdesign.bench.discrepancy.effects.Effect`) in one of its public
    modules, and
    the rubbers of a file ``materials.toml`` beside its ``__init__.py``. After the block none of it is known.

    ``packages``: imported packages or modules; those of a block around this one stay.

    Examples
    --------
    >>> from nlsdesign.components import component_classes
    >>> import my_laws  # doctest: +SKIP
    >>> with extended_by(my_laws):  # doctest: +SKIP
    ...     component_classes()["MyLaw"]
    """
    before = _PRESENT.set(tuple(dict.fromkeys((*_PRESENT.get(), *packages))))
    try:
        yield
    finally:
        _PRESENT.reset(before)


def extension_modules() -> tuple[ModuleType, ...]:
    """Return the public modules of the packages that the present block is extended by."""
    return tuple(dict.fromkeys(module for package in _PRESENT.get() for module in _modules(package)))


def extension_files(name: str) -> tuple[Path, ...]:
    """Return the files of a name that stand beside the ``__init__.py`` of the packages that are there."""
    folders = [Path(each) for package in _PRESENT.get() for each in getattr(package, "__path__", ())]
    return tuple(file for file in (folder / name for folder in folders) if file.is_file())


def extension_names() -> tuple[str, ...]:
    """Return the names by which another process loads the packages that are there: :func:`load_extension`."""
    return tuple(_name_of(package) for package in _PRESENT.get())


def load_extension(name: str) -> ModuleType:
    """Import a package, or the module of one Python file."""
    try:
        return _from_file(Path(name)) if name.endswith(".py") else importlib.import_module(name)
    except NlsError:
        raise
    except ModuleNotFoundError as error:
        if error.name is not None and (name == error.name or name.startswith(f"{error.name}.")):
            step = f"install it beside nlsdesign ({sys.executable} -m pip install ...), or give a .py file"
            raise NlsError(f"package '{name}'", "is not installed", next_step=step) from None
        raise _failed(name, error) from error
    except Exception as error:
        raise _failed(name, error) from error


def _name_of(module: ModuleType) -> str:
    of_a_file = module.__name__.startswith(_OF_A_FILE)
    return str(Path(str(module.__file__)).absolute()) if of_a_file else module.__name__


def _failed(name: str, error: Exception) -> NlsError:
    """Return the error of a module that raised one while it was imported."""
    rule = f"cannot be imported: {type(error).__name__}: {error}"
    return NlsError(f"package '{name}'", rule, next_step="import it in Python to see where")


def _from_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise NlsError(str(path), "no such file", next_step="give a .py file or an installed package")
    name = f"{_OF_A_FILE}{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise NlsError(str(path), "cannot be loaded as Python")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@functools.cache
def _modules(package: ModuleType) -> tuple[ModuleType, ...]:
    """Return a module and all below it but those whose name begins with an underscore."""
    return (package, *_below(package))


def _below(package: ModuleType) -> Iterator[ModuleType]:
    for listed in pkgutil.iter_modules(getattr(package, "__path__", ())):
        if not listed.name.startswith("_"):
            module = load_extension(f"{package.__name__}.{listed.name}")
            yield module
            yield from _below(module)
