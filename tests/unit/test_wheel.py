"""What travels in the wheel and where it lands, read from a wheel built here."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

FOLDERS = {
    "nlsdesign": "nlsdesign",
    "models": "nlsdesign/_bundled/models",
    "studies": "nlsdesign/_bundled/studies",
}


@pytest.fixture(scope="module")
def wheel(root: Path, tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """Names of the files in the wheel."""
    pytest.importorskip("hatchling", reason="building the wheel needs hatchling, which the locked set holds")
    out = tmp_path_factory.mktemp("wheel")
    build = "import sys; from hatchling.build import build_wheel; build_wheel(sys.argv[1])"
    subprocess.run([sys.executable, "-c", build, str(out)], cwd=root, check=True, stdin=subprocess.DEVNULL)
    (file,) = out.glob("nlsdesign-*.whl")
    return set(zipfile.ZipFile(file).namelist())


def test_only_the_package_reaches_site_packages(wheel: set[str]) -> None:
    tops = {name.split("/", 1)[0] for name in wheel}
    assert len(tops) == 2
    assert all(top == "nlsdesign" or top.endswith(".dist-info") for top in tops)


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_file_travels(root: Path, wheel: set[str], folder: str) -> None:
    here = {
        file.relative_to(root / folder).as_posix()
        for file in (root / folder).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    assert here, f"{folder}/ is empty"
    missing = {name for name in here if f"{FOLDERS[folder]}/{name}" not in wheel}
    assert not missing, f"not in the wheel: {sorted(missing)}"


def test_types_and_command_travel(wheel: set[str]) -> None:
    assert {"nlsdesign/py.typed", "nlsdesign/__init__.pyi", "nlsdesign/bibliography.toml"} <= set(wheel)
    assert any(name.endswith(".dist-info/entry_points.txt") for name in wheel)
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in wheel)
