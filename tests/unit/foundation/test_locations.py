"""The folders models/ and studies/ are found in a checkout and in a wheel, and nowhere else."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from nlsdesign.foundation import locations
from nlsdesign.foundation.errors import UnknownNameError


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "nlsdesign"
    folder.mkdir()
    return folder


def write_project(package: Path, name: str) -> None:
    text = f'[project]\nname = "{name}"\nversion = "7.8.9"\n'
    (package.parent / "pyproject.toml").write_text(text, encoding="utf-8")


@pytest.mark.parametrize("name", ["models", "studies"])
def test_this_checkout(root: Path, name: str) -> None:
    assert locations.folder(name) == root / name
    assert any(locations.folder(name).glob("*.py"))


def test_the_documentation_of_this_checkout(root: Path) -> None:
    assert locations.folder("docs") == root / "docs"


@pytest.mark.parametrize("name", ["models", "studies", "docs"])
def test_wheel_before_a_stranger(package: Path, name: str) -> None:
    (package / "_bundled" / name).mkdir(parents=True)
    (package.parent / name).mkdir()
    assert locations.folder(name, package=package) == package / "_bundled" / name


def test_checkout_is_recognised_by_its_project_file(package: Path) -> None:
    (package.parent / "models").mkdir()
    write_project(package, "nlsdesign")
    assert locations.folder("models", package=package) == package.parent / "models"


@pytest.mark.parametrize("name", [None, "somebody_else"])
def test_folder_of_somebody_else_is_not_taken(package: Path, name: str | None) -> None:
    (package.parent / "models").mkdir()
    if name:
        write_project(package, name)
    with pytest.raises(UnknownNameError, match=r"folder 'models'.*-> install nlsdesign again"):
        locations.folder("models", package=package)


def test_version_of_the_checkout(root: Path, package: Path) -> None:
    written = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert locations.version() == written
    write_project(package, "nlsdesign")
    assert locations.version(package=package) == "7.8.9"
