"""Packages of one's own bring laws, effects and rubbers for as long as a block lasts."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.bench.discrepancy.effects import catalogue
from nlsdesign.components import component_classes, materials
from nlsdesign.components.materials.material_law import law_of
from nlsdesign.foundation.errors import ArrangementError, DeckError, NlsError
from nlsdesign.foundation.extensions import extended_by, load_extension
from nlsdesign.live.edits import drop_limit, edit
from nlsdesign.live.gallery import question_of_deck
from nlsdesign.live.live_design import LiveDesign
from tests.command_line import Run, run

__all__ = ["run"]
DECK = "decks/jointed.toml"


@pytest.fixture
def lab(root: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The example package as if it were installed; returns its folder."""
    folder = root / "examples" / "rubber_lab"
    monkeypatch.syspath_prepend(str(folder / "src"))
    yield folder
    for name in [each for each in sys.modules if each.partition(".")[0] == "rubber_lab"]:
        del sys.modules[name]


def test_a_law_an_effect_and_a_rubber_are_known_within_the_block_only(lab: Path) -> None:
    deck = nls.load_deck(str(lab / DECK))
    before = set(component_classes()), {row.__name__ for row in catalogue()}, set(materials())
    with pytest.raises(NlsError, match="'Gent' is not a component"):
        nls.declare(deck)
    with extended_by(load_extension("rubber_lab")):
        joint = nls.declare(deck)
        after = set(component_classes()), {row.__name__ for row in catalogue()}, set(materials())
        fitted = law_of(nls.material("lab_rubber"))
    new = [now - then for now, then in zip(after, before, strict=True)]
    assert new == [{"Gent", "WireBundle"}, {"wire_bundle"}, {"lab_rubber"}]
    assert fitted.rms_error is not None
    assert fitted.rms_error < 0.05
    assert component_classes().keys() == before[0]
    # What was declared stays sound after the block: an object needs no name to be looked up.
    model = nls.flatten(joint, outputs=["spring.rubber.force"])
    run_of_it = nls.simulate(model, np.linspace(0.0, 0.1, 11), inputs={"motor.current": 1.0})
    stretch = 1.0 + 1.0 / 25.0
    stress = 0.5e6 * 30.0 / (30.0 - (stretch**2 + 2.0 / stretch - 3.0)) * (stretch - stretch**-2)
    assert run_of_it["spring.rubber.force"][0] == pytest.approx(1e-4 * stress, rel=1e-9)


def test_the_deck_of_such_a_machine_reads_back(lab: Path, tmp_path: Path) -> None:
    with extended_by(load_extension("rubber_lab")):
        joint = nls.declare(nls.load_deck(str(lab / DECK)))
        nls.write_deck(joint, tmp_path / "again.toml")
        assert nls.declare(nls.load_deck(str(tmp_path / "again.toml"))) == joint


def test_commands_take_a_package_and_a_file(lab: Path, run: Run, tmp_path: Path) -> None:
    status, _, err = run("deck", "check", str(lab / DECK))
    assert status == 2
    assert "'Gent' is not a component" in err
    status, out, _ = run("--with", "rubber_lab", "deck", "check", str(lab / DECK))
    assert status == 0
    assert out.startswith("jointed.toml: no problem in 16 numbers, 100 % of them only assumed\n")
    (tmp_path / "mine.py").write_text((lab / "src/rubber_lab/laws.py").read_text("utf-8"), "utf-8")
    status, out, _ = run("--with", "mine.py", "parts", "Gent")
    assert status == 0
    assert "Chains that come to an end" in out
    assert run("parts", "Gent")[0] == 2, "the command before has left something behind"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("no_such_package_here", None, "package 'no_such_package_here': is not installed -> install it"),
        ("lost.py", None, "lost.py: no such file -> give a .py file or an installed package"),
        ("odd.py", "import no_such_thing_here\n", "package 'odd.py': cannot be imported: ModuleNotFound"),
        ("odd.py", "def (:\n", "package 'odd.py': cannot be imported: SyntaxError"),
        ("odd.py", "1 / 0\n", "package 'odd.py': cannot be imported: ZeroDivisionError"),
        ("..", None, "package '..': cannot be imported"),
    ],
)
def test_what_cannot_be_imported_is_one_message(
    run: Run, tmp_path: Path, name: str, text: str | None, message: str
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text, "utf-8")
    status, out, err = run("--with", name, "deck", "list")
    assert (status, out) == (2, "")
    assert f"error: {message}" in err


def _module(tmp_path: Path, text: str) -> ModuleType:
    (tmp_path / "twice.py").write_text(text, "utf-8")
    return load_extension(str(tmp_path / "twice.py"))


def test_two_of_one_name_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    law = "from nlsdesign.components import Spring as Base\nclass Spring(Base):\n    pass\n"
    with (
        extended_by(_module(tmp_path, law)),
        pytest.raises(ArrangementError, match=r"twice\.Spring: has the name of a component of nlsdesign"),
    ):
        component_classes()
    row = (
        "from nlsdesign.bench.discrepancy.effects import Effect\nmine = Effect('backlash', 'Mine.', 1, ())\n"
    )
    with (
        extended_by(_module(tmp_path, row)),
        pytest.raises(ArrangementError, match="has an effect 'backlash', and so has the catalogue"),
    ):
        catalogue()
    package = tmp_path / "doubled"
    package.mkdir()
    (package / "__init__.py").write_text("", "utf-8")
    text = (
        '[EPDM]\nfamily = "a"\ngrade = "b"\nremark = ""\n[EPDM.x]\nmeasures = "c"\nvalue = 1\nunit = "Pa"\n'
    )
    (package / "materials.toml").write_text(text + 'source = "d"\nevidence = "data sheet"\n', "utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    with (
        extended_by(load_extension("doubled")),
        pytest.raises(DeckError, match="'EPDM' stands in another library already"),
    ):
        materials()


def test_modules_that_are_private_are_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "shy"
    package.mkdir()
    (package / "__init__.py").write_text("", "utf-8")
    (package / "_inner.py").write_text("raise RuntimeError('imported')\n", "utf-8")
    (package / "laws.py").write_text(
        "from nlsdesign.components import Yeoh\nclass Law(Yeoh): pass\n", "utf-8"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    with extended_by(load_extension("shy")):
        assert "Law" in component_classes()


def _in_long_work(stage: object, machine: object) -> tuple[bool, str]:
    """What the process of a piece of long work knows and makes of a machine with an own law."""
    model = nls.flatten(machine)  # type: ignore[arg-type]
    return "Gent" in component_classes(), model.name


@pytest.mark.parametrize(
    "as_file", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["file", "package"]
)
def test_long_work_of_the_live_page_knows_them_too(lab: Path, tmp_path: Path, as_file: bool) -> None:
    from nlsdesign.live.background import BackgroundWork

    (tmp_path / "mine.py").write_text((lab / "src/rubber_lab/laws.py").read_text("utf-8"), "utf-8")
    with extended_by(load_extension(str(tmp_path / "mine.py") if as_file else "rubber_lab")):
        machine = nls.declare(nls.load_deck(str(lab / DECK)))
        done = BackgroundWork("flatten", 1, _in_long_work, (machine,)).wait(120.0)
    assert (done.state, done.message) == ("done", "")
    assert done.value[0]


@pytest.mark.slow
def test_a_package_beside_the_command_reaches_a_session_of_the_live_page(
    lab: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``python -m nlsdesign`` finds packages in its folder; the session is started without it."""
    import asyncio
    import json

    from nlsdesign.live.session_process import SessionProcess

    (tmp_path / "beside").mkdir()
    (tmp_path / "beside" / "__init__.py").write_bytes((lab / "src/rubber_lab/laws.py").read_bytes())
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend("")

    async def first_words() -> str:
        heard: asyncio.Queue[str] = asyncio.Queue()
        process = SessionProcess(str(lab / DECK), ("beside",))
        try:
            await process.start()
            process.listen(heard.put)
            await process.from_page({"what": "show", "number": 1})
            return await asyncio.wait_for(heard.get(), 120.0)
        finally:
            process.kill()
            await process.gone()

    answer = json.loads(asyncio.run(first_words()))
    assert (answer["what"], answer["answer"]["controls"]["title"]) == ("answer", "jointed")


def test_a_live_design_of_a_law_that_ends_begins_within_a_strain(lab: Path) -> None:
    """Gent's law has no value beyond a stretch, and the deck declares no strength that would keep it away."""
    text = (lab / DECK).read_text(encoding="utf-8")
    with extended_by(load_extension("rubber_lab")):
        question = question_of_deck(text, "jointed.toml")
    assert dict(question.limits) == {"MaximumStrain": 0.75}


@pytest.mark.slow
def test_a_live_design_of_a_law_that_ends_is_solved_and_says_what_it_needs(lab: Path) -> None:
    text = (lab / DECK).read_text(encoding="utf-8")
    with extended_by(load_extension("rubber_lab")):
        live = LiveDesign(question_of_deck(text, "jointed.toml"))
        assert live.answer.state == "solved", live.answer.message
        answer = live.apply(edit(drop_limit, "MaximumStrain"))
    assert answer.state == "not solved"
    assert answer.message.endswith("Add a largest strain, or hold spring.pretension")
