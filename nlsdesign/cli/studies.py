"""``nlsdesign study``: list and run design studies, and hold their numbers against what they claim."""

from __future__ import annotations

import importlib.util
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from ..errors import NlsError, unknown_name
from ..locations import bundled, folder
from .output import json_option, show_json, show_table


@dataclass(frozen=True)
class Claim:
    """A number that a study claims: value, unit, and how far off it may be.

    Parameters
    ----------
    value, tolerance
        In ``unit``; the tolerance is absolute.
    unit
        As text.
    why
        What the tolerance covers.
    """

    value: float
    tolerance: float
    unit: str
    why: str

    def holds(self, found: float) -> bool:
        """Tell whether a result agrees with the claim.

        Parameters
        ----------
        found
            Result in the same unit.
        """
        return abs(found - self.value) <= self.tolerance


def study_names() -> list[str]:
    """Return the names of the studies that come with the project."""
    return sorted(p.stem for p in folder("studies").glob("*.py") if not p.stem.startswith("_"))


def load_study(name: str) -> Any:
    """Return a study as a module with ``main(out, fast, steps)``.

    Parameters
    ----------
    name
        Name of a study that comes with the project, or path of a Python file.

    Raises
    ------
    UnknownNameError
        If there is no such study.
    NlsError
        If there is no such file, or it cannot be loaded as Python.
    """
    path = Path(name)
    if path.suffix != ".py":
        if name not in study_names():
            raise unknown_name("study", name, study_names())
        return bundled("studies", name)
    if not path.exists():
        raise NlsError(str(path), "no such file", next_step="give the name of a study or a .py file")
    spec = importlib.util.spec_from_file_location(f"nlsdesign_study_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise NlsError(str(path), "cannot be loaded as Python")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def claims(name: str) -> dict[str, Claim]:
    """Return what a study claims in ``expected.toml``.

    Parameters
    ----------
    name
        Name of the study.
    """
    path = folder("studies") / "expected.toml"
    tables: Mapping[str, Any] = tomllib.loads(path.read_text(encoding="utf8")) if path.exists() else {}
    return {key: Claim(**table) for key, table in tables.get(name, {}).items()}


@click.group()
def study() -> None:
    """List and run design studies."""


@study.command("list")
def list_studies() -> None:
    """List the studies that come with the project."""
    rows = [(name, (load_study(name).__doc__ or "").strip().splitlines()[0]) for name in study_names()]
    show_table("Studies", ("name", "what it shows"), rows)


@study.command()
@click.argument("name")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=None,
    help="Folder for the results; out/NAME by default.",
)
@click.option("--fast", is_flag=True, help="Coarser and shorter, for a first look.")
@json_option
def run(name: str, out: Path | None, fast: bool, as_json: bool) -> None:
    """Run a study; exit status 1 if one of its numbers is not the one that it claims."""
    from ..progress import Steps

    module = load_study(name)
    target = out if out is not None else Path("out") / Path(name).stem
    target.mkdir(parents=True, exist_ok=True)
    results: Mapping[str, float] = module.main(target, fast=fast, steps=Steps())
    expected = claims(Path(name).stem)
    failed = [key for key, claim in expected.items() if key in results and not claim.holds(results[key])]
    if as_json:
        show_json({"results": dict(results), "not_as_claimed": failed, "out": target})
    else:
        show_table(
            f"Study {name}",
            ("result", "value", "claimed"),
            [_row(k, v, expected.get(k)) for k, v in results.items()],
        )
        click.echo(f"report: {target / 'report.html'}")
    for key in failed:
        wanted = f"{expected[key].value:.4g} ± {expected[key].tolerance:.2g}"
        click.echo(f"not as claimed: {key} = {results[key]:.4g}, expected {wanted}", err=True)
    sys.exit(1 if failed and not fast else 0)


def _row(key: str, value: float, claim: Claim | None) -> tuple[str, str, str]:
    unit = f" {claim.unit}" if claim and claim.unit != "1" else ""
    told = f"{claim.value:.4g} ± {claim.tolerance:.2g}{unit}" if claim else ""
    return key, f"{value:.4g}{unit}", told
