"""What travels in the wheel and where it lands, read from a wheel built here."""

from __future__ import annotations

import importlib.util
import posixpath
import re
import subprocess
import sys
import zipfile
from email import message_from_bytes
from email.message import Message
from pathlib import Path, PurePosixPath
from types import ModuleType

import pytest

from tests import wheels

FOLDERS = {
    "nlsdesign": "nlsdesign",
    "models": "nlsdesign/_bundled/models",
    "studies": "nlsdesign/_bundled/studies",
    "docs": "nlsdesign/_bundled/docs",
}


README = """See [the way](docs/way.md), [there](https://example.org/x), [below](#end) and ![p](docs/p.png).

```python
x = a[0](b)
```
"""


@pytest.fixture(scope="module")
def built(root: Path, tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """The wheel."""
    pytest.importorskip("hatchling", reason="building the wheel needs hatchling, which the locked set holds")
    out = tmp_path_factory.mktemp("wheel")
    build = "import sys; from hatchling.build import build_wheel; build_wheel(sys.argv[1])"
    subprocess.run([sys.executable, "-c", build, str(out)], cwd=root, check=True, stdin=subprocess.DEVNULL)
    (file,) = out.glob("nlsdesign-*.whl")
    return zipfile.ZipFile(file)


@pytest.fixture(scope="module")
def wheel(built: zipfile.ZipFile) -> set[str]:
    """Names of the files in the wheel."""
    return set(built.namelist())


@pytest.fixture(scope="module")
def metadata(built: zipfile.ZipFile, wheel: set[str]) -> Message:
    """What a package index is given."""
    (name,) = (each for each in wheel if each.endswith(".dist-info/METADATA"))
    return message_from_bytes(built.read(name))


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
    assert {"nlsdesign/py.typed", "nlsdesign/__init__.pyi", "nlsdesign/foundation/bibliography.toml"} <= set(
        wheel
    )
    assert any(name.endswith(".dist-info/entry_points.txt") for name in wheel)
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in wheel)


def test_the_metadata_say_what_is_so(metadata: Message, root: Path) -> None:
    assert (metadata["License-Expression"], metadata["License-File"]) == ("MIT", "LICENSE")
    assert metadata["Requires-Python"] == ">=3.11"
    heads = [each.rpartition(" ")[2] for each in metadata.get_all("Classifier", []) if "Python :: 3." in each]
    assert heads == list(wheels.VERSIONS) == list(wheels.supported())
    known = set(metadata.get_all("Provides-Extra", []))
    install = (root / "docs" / "install.md").read_text(encoding="utf-8")
    table = install.partition("| extra |")[2].partition("\n\n")[0]
    listed = set(re.findall(r"^\| `(\w+)` \|", table, flags=re.MULTILINE))
    assert listed == known - {"mutation"}


def test_no_link_of_the_long_description_is_dead(metadata: Message, root: Path) -> None:
    text = metadata.get_payload()
    assert isinstance(text, str)
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert "docs/architecture.md" in text or "draws it" in text
    prose = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    targets = re.findall(r"\]\(([^)]+)\)", prose)
    assert [each for each in targets if not each.startswith(("https://", "#"))] == []
    readme = (root / "README.md").read_text(encoding="utf-8")
    assert len(text) > 0.8 * len(readme)
    assert re.search(r"\]\(docs/", readme), "the README has links that would be dead"


def test_no_relative_link_of_a_page_that_travels_is_dead(built: zipfile.ZipFile, wheel: set[str]) -> None:
    assert len(built.namelist()) == len(wheel), "a file travels twice"
    pages = [name for name in wheel if name.startswith("nlsdesign/_bundled/docs/") and name.endswith(".md")]
    folders = {parent.as_posix() for name in wheel for parent in PurePosixPath(name).parents}
    dead, alive = [], 0
    for name in pages:
        prose = re.sub(r"^```.*?^```$", "", built.read(name).decode("utf-8"), flags=re.MULTILINE | re.DOTALL)
        for target in re.findall(r"\[[^\]]+\]\(([^)\s]+)\)", prose):
            if re.match(r"[a-z][a-z0-9+.-]*:|#", target):
                continue
            place = posixpath.normpath(posixpath.join(posixpath.dirname(name), target.partition("#")[0]))
            alive += place in wheel or place in folders
            dead += [] if place in wheel or place in folders else [(name, target)]
    assert not dead
    assert alive > 50


def hook(root: Path) -> ModuleType:
    pytest.importorskip("hatchling", reason="the hook is one of hatchling")
    spec = importlib.util.spec_from_file_location("hatch_build", root / "hatch_build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_an_old_python_is_told_by_one_sentence(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "version_info", (3, 9, 18))
    with pytest.raises(SystemExit, match=r"^nlsdesign needs Python 3\.11 or newer; this is "):
        hook(root)


def test_links_are_words_without_a_home_and_absolute_with_one(root: Path) -> None:
    described = hook(root).described
    plain, linked = described(README), described(README, "https://example.org/home/")
    assert "See the way, [there](https://example.org/x), [below](#end)" in plain
    assert "[the way](https://example.org/home/docs/way.md)" in linked
    assert "![p]" not in plain
    assert "![p](https://example.org/home/docs/p.png)" in linked
    for text in (plain, linked):
        assert "x = a[0](b)" in text


def test_a_python_that_is_not_there_is_passed_over() -> None:
    here = f"{sys.version_info.major}.{sys.version_info.minor}"
    assert wheels.interpreter("2.0") is None
    found = wheels.interpreter(here)
    assert found is not None
    assert found.is_file()
