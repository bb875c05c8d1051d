"""``nlsdesign study``: list and run design studies, and compare their numbers with the claimed ones."""

from __future__ import annotations

import contextlib
import importlib.util
import inspect
import sys
import tomllib
import traceback
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol, SupportsFloat, runtime_checkable

import click

from ..foundation.errors import NlsError, brief, unknown_name
from ..foundation.locations import bundled, folder
from ..foundation.quantity import with_unit
from ..foundation.text_files import is_there, listed_files, make_folder, text_of
from .options import json_option, workers_option
from .output import examples, show_json, show_table
from .overwriting import dry_run_option, force_option, kept, list_files
from .typed_values import NamedPath

_SIGNATURE = "def main(out, fast=False): ..."


@dataclass(frozen=True)
class Claim:
    """A number that a study claims, with unit and tolerance."""

    value: float
    tolerance: float
    unit: str
    why: str

    def holds(self, result: float) -> bool:
        """Tell whether a result agrees with the claim."""
        return abs(result - self.value) <= self.tolerance


@runtime_checkable
class Results(Protocol):
    """What ``main(out, fast=False)`` of a study returns: any typed object that lists its numbers."""

    @property
    def numbers(self) -> Mapping[str, float]:
        """The results by the names of ``expected.toml``."""
        ...


def study_names() -> list[str]:
    """Return the names of the studies that come with the project: modules and packages."""
    place = folder("studies")
    modules = [path.stem for path in place.glob("*.py")]
    packages = [path.parent.name for path in place.glob("*/__init__.py")]
    return sorted(name for name in (*modules, *packages) if not name.startswith("_"))


def load_study(name: str) -> ModuleType:
    """Return a study as a module with ``main(out, fast=False)``."""
    path = Path(name)
    if path.suffix != ".py":
        if name not in study_names():
            raise unknown_name("study", name, study_names())
        return bundled("studies", name)
    if not is_there(path):
        raise NlsError(str(path), "no such file", next_step="give the name of a study or a .py file")
    text_of(path, NlsError, next_step="give a Python file")
    spec = importlib.util.spec_from_file_location(f"nlsdesign_study_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise NlsError(str(path), "cannot be loaded as Python")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    with _mistakes_named(path):
        spec.loader.exec_module(module)
    if not callable(getattr(module, "main", None)):
        raise NlsError(str(path), "has no function main", next_step=f"write {_SIGNATURE}")
    return module


@contextlib.contextmanager
def _mistakes_named(path: Path) -> Iterator[None]:
    """Turn whatever a study of somebody's own raises into one message with its line."""
    try:
        yield
    except NlsError as error:
        raise error.at(_line_of(error, path)) from None
    except SystemExit as leaving:
        rule = f"ends the program by itself (exit status {brief(leaving.code)})"
        raise NlsError(_line_of(leaving, path), rule, next_step="return from main instead") from None
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise NlsError(_line_of(error, path), reason, next_step="correct the study") from None


def _line_of(error: BaseException, path: Path) -> str:
    """Return file and line of a study at which an error began."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f"{path}:{error.lineno}"
    lines = [
        f.lineno for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).name == path.name
    ]
    return f"{path}:{lines[-1]}" if lines else str(path)


def claims(name: str) -> dict[str, Claim]:
    """Return the claims of a study in ``expected.toml``."""
    path = folder("studies") / "expected.toml"
    tables: Mapping[str, Any] = tomllib.loads(path.read_text(encoding="utf8")) if path.exists() else {}
    return {key: Claim(**table) for key, table in tables.get(name, {}).items()}


def run_study(name: str, out: Path, *, fast: bool = False) -> dict[str, float]:
    """Run a study and return its numbers; none where it was skipped."""
    study = load_study(name)
    if Path(name).suffix == ".py":
        try:
            inspect.signature(study.main).bind(Path(), fast=False)
        except TypeError as error:
            raise NlsError(
                f"{name}: main", f"cannot be called so: {error}", next_step=f"write {_SIGNATURE}"
            ) from None
        with _mistakes_named(Path(name)):
            results = study.main(out, fast=fast)
    else:
        results = study.main(out, fast=fast)
    if results is None:
        return {}
    if not isinstance(results, Results):
        raise NlsError(
            f"study '{name}'",
            f"main() returned {type(results).__name__}, which has no property 'numbers'",
            next_step="return an object whose 'numbers' is a mapping of float by name, or None if skipped",
        )
    numbers = results.numbers
    if not isinstance(numbers, Mapping):
        raise NlsError(f"study '{name}'", f"its numbers are {brief(numbers)}, not a mapping of float by name")
    for key, value in numbers.items():
        if not isinstance(key, str) or isinstance(value, bool) or not isinstance(value, SupportsFloat):
            raise NlsError(f"study '{name}'", f"its number {brief(key)} is {brief(value)}, not a float")
    return {key: float(value) for key, value in numbers.items()}


def not_as_claimed(results: Mapping[str, float], expected: Mapping[str, Claim]) -> dict[str, str]:
    """Return the claimed numbers that are outside their tolerance or not computed, each with a message.

    ``results``: numbers of a study; without any it was skipped, and nothing is wrong.
    """
    wrong = {}
    for key, claim in expected.items() if results else ():
        wanted = f"expected {claim.value:.4g} ± {claim.tolerance:.2g}"
        if key not in results:
            wrong[key] = f"{key} was not computed, {wanted}"
        elif not claim.holds(results[key]):
            wrong[key] = f"{key} = {results[key]:.4g}, {wanted}"
    return wrong


@click.group()
def study() -> None:
    """List and run design studies."""


@study.command("list", epilog=examples("nlsdesign study list", "nlsdesign study list --json"))
@json_option
def list_studies(as_json: bool) -> None:
    """List the studies that come with the project."""
    rows, place = [], folder("studies")
    for name in study_names():
        # The first line of its docstring: a study is read and not loaded.
        file = next(path for path in (place / f"{name}.py", place / name / "__init__.py") if path.exists())
        text = file.read_text(encoding="utf-8").removeprefix('"""')
        rows.append((name, text.partition("\n")[0].rstrip('"')))
    if as_json:
        show_json(dict(rows))
        return
    show_table("Studies", ("name", "what it shows"), rows)


@study.command(
    epilog=examples(
        "nlsdesign study run hello",
        "nlsdesign study run austin2015 --fast --out out/first_look",
        "nlsdesign study run my_study.py --json",
    )
)
@click.argument("name", metavar="STUDY")
@click.option(
    "--out",
    type=NamedPath(file_okay=False, example="out/hello"),
    default=None,
    help="Folder for the results; out/NAME by default.",
)
@workers_option
@click.option("--fast", is_flag=True, help="Coarser and shorter, for a first look.")
@force_option
@dry_run_option
@json_option
def run(name: str, out: Path | None, fast: bool, as_json: bool, force: bool, dry_run: bool) -> None:
    """Run a study. Exit status 1 if a number differs from its claim."""
    target = out if out is not None else Path("out") / Path(name).stem
    if dry_run:
        list_files(listed_files(target), target, as_json=as_json)
    report, own = target / "report.html", Path(name).suffix == ".py"
    before = _time_of(report)
    load_study(name)  # a name that does not exist leaves no folder
    with kept(target, listed_files(target), force=force), _no_empty_folder(target):
        make_folder(target)
        results = run_study(name, target, fast=fast)
    # A study of one's own may be named as one that comes with the project, and claims nothing.
    expected = {} if own else claims(name)
    wrong = not_as_claimed(results, {k: c for k, c in expected.items() if k in results or not fast})
    if as_json:
        show_json({"results": results, "not_as_claimed": list(wrong), "out": target})
    else:
        rows = []
        for key, value in results.items():
            claim = expected.get(key)
            unit = claim.unit if claim else "1"
            claimed = with_unit(f"{claim.value:.4g} ± {claim.tolerance:.2g}", unit) if claim else ""
            rows.append((key, with_unit(f"{value:.4g}", unit), claimed))
        show_table(f"Study {name}", ("result", "value", "claimed"), rows)
        if not results:
            click.echo("no numbers: the study was skipped, or its main returns None")
        if _time_of(report) != before:
            click.echo(f"report: {report}")
    for message in wrong.values():
        click.echo(f"not as claimed: {message}", err=True)
    sys.exit(1 if wrong and not fast else 0)


@contextlib.contextmanager
def _no_empty_folder(target: Path) -> Iterator[None]:
    """Take a folder away again that a run has made and left without a file, when it fails."""
    absent = [each for each in (target, *target.parents) if not each.exists()]
    try:
        yield
    except BaseException:
        for each in absent:
            with contextlib.suppress(OSError):  # it holds something
                each.rmdir()
        raise


def _time_of(file: Path) -> int | None:
    """Return when a file was written, in ns; none where there is no such file."""
    return file.stat().st_mtime_ns if file.is_file() else None
