"""The public names: stub, run-time import and reference page say the same, and the names have types."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import nlsdesign as nls

ROW = re.compile(r"^\| `nls\.(\w+)` \| (.*) \|$", flags=re.MULTILINE)


def listed(root: Path) -> dict[str, str]:
    """Return the module of each name in the stub, as Python would import it."""
    homes = {}
    for node in ast.parse((root / "nlsdesign" / "__init__.pyi").read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            homes |= {a.name: "nlsdesign" + (f".{node.module}" if node.module else "") for a in node.names}
    return homes


def summary(thing: object) -> str:
    """Return the first paragraph of a docstring on one line."""
    return " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())


def test_the_stub_and_the_package_list_the_same_names(root: Path) -> None:
    names = listed(root)
    assert {*names, "models", "__version__"} == set(dir(nls))
    public = [name for name in names if not inspect.ismodule(getattr(nls, name))]
    assert 50 <= len(public) <= 75, "about 60 names are a front door, more are a warehouse"


def test_each_name_is_the_object_of_its_module(root: Path) -> None:
    # All first: importing a module binds its name in the package, which must not hide a public name.
    modules = {home: importlib.import_module(home) for home in listed(root).values()}
    for name, home in listed(root).items():
        owner = modules[home]
        inner = sys.modules[f"nlsdesign.{name}"] if owner is nls else vars(owner).get(name)
        assert inner is not None, f"{home} has no {name}"
        assert getattr(nls, name) is inner, name
    assert isinstance(nls.models, ModuleType)
    assert nls.models.cam_rubber_actuator.__name__ == "cam_rubber_actuator"


def test_no_public_name_is_hidden_by_a_module_of_the_package(root: Path) -> None:
    inner = {path.stem for path in (root / "nlsdesign").iterdir() if path.suffix == ".py" or path.is_dir()}
    hidden = {name for name, home in listed(root).items() if name in inner and home != "nlsdesign"}
    assert hidden == set()


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        ("Yeoh", "it is nlsdesign.components.Yeoh"),
        ("TableSection", "it is nlsdesign.presentation.report.TableSection"),
        ("Shots", "it is nlsdesign.bench.identification.Shots"),
        ("UnitError", "it is nlsdesign.foundation.errors.UnitError"),
        ("rest_state", "it is nlsdesign.model.linear.rest_state"),
        ("flaten", "did you mean 'flatten'?"),
        ("xxxxxxxxxxx", "dir(nlsdesign) lists the public names"),
    ],
)
def test_a_name_that_is_not_public_here_is_answered_with_its_place(name: str, advice: str) -> None:
    with pytest.raises(AttributeError) as caught:
        getattr(nls, name)
    assert str(caught.value).startswith(f"nlsdesign has no name '{name}'; ")
    assert str(caught.value).endswith(advice)


def test_private_names_are_refused_without_a_search() -> None:
    with pytest.raises(AttributeError, match=r"^__wrapped__$"):
        getattr(nls, "__wrapped__")  # noqa: B009


@pytest.mark.slow
def test_a_type_checker_sees_every_name(root: Path, tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    names = sorted({*listed(root), "models"})
    lines = ["import nlsdesign as nls", *(f"reveal_type(nls.{name})" for name in names)]
    lines += ["reveal_type(nls.models.cam_rubber_actuator)", "nls.Yeoh"]
    (tmp_path / "seen.py").write_text("\n".join(lines) + "\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", str(tmp_path / "seen.py")],
        capture_output=True, text=True, cwd=root, timeout=600,
    )  # fmt: skip
    seen = re.findall(r'seen\.py:(\d+): note: Revealed type is "(.*)"', done.stdout)
    types = {lines[int(line) - 1][16:-1]: text for line, text in seen}
    assert set(types) == {*names, "models.cam_rubber_actuator"}, done.stdout + done.stderr
    assert not {name: text for name, text in types.items() if text == "Any" or text.startswith("def (*Any")}
    assert types["flatten"].startswith("def (assembly: nlsdesign.components.assembly.named_parts.Assembly")
    assert types["flatten"].endswith("-> nlsdesign.model.flat.FlatModel")
    assert types["models.cam_rubber_actuator"].startswith("def (deck: nlsdesign.foundation.deck.Deck)")
    wrong = [line for line in done.stdout.splitlines() if ": error:" in line]
    assert len(wrong) == 1, done.stdout
    assert 'Module has no attribute "Yeoh"' in wrong[0]


def test_the_reference_page_says_what_the_docstrings_say(root: Path) -> None:
    text = (root / "docs" / "reference.md").read_text(encoding="utf-8")
    rows = ROW.findall(text)
    assert len(rows) == len(dict(rows)), "a name stands twice in docs/reference.md"
    assert set(dict(rows)) == set(dir(nls)) - {"__version__"}
    old = [name for name, said in rows if said != summary(getattr(nls, name))]
    wanted = "\n".join(f"| `nls.{name}` | {summary(getattr(nls, name))} |" for name in old)
    assert not old, f"docs/reference.md should say:\n{wanted}"


def test_an_old_component_name_is_answered_with_the_new_one() -> None:
    with pytest.raises(AttributeError, match=r"'TorsionSpring'.*write Spring"):
        _ = nls.TorsionSpring
