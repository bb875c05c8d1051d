"""The documentation site: what its pages say of the package is complete, and the package can read it."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

import nlsdesign
from docs.site import (
    api,
    bibliography,
    catalogue,
    check,
    collect,
    commands,
    formula,
    landing,
    markup,
    materials,
    navigation,
    parts,
    stage,
)
from nlsdesign.bench.discrepancy.effects import ALL
from nlsdesign.cli.main import program
from nlsdesign.cli.studies import study_names
from nlsdesign.components import Part
from nlsdesign.components.assembly.deck_reader import component_classes
from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.design.jobs.job_file import kinds
from nlsdesign.foundation import rubber_library as library
from nlsdesign.foundation.deck import read_deck
from nlsdesign.model import flatten
from tests.browser import OUT_OF_SIGHT, browser, chromium

INSTANCES = parts.instances()


def tree(path: str, command: click.Command) -> Iterator[tuple[str, click.Command]]:
    yield path, command
    if isinstance(command, click.Group):
        for name, inner in command.commands.items():
            yield from tree(f"{path} {name}", inner)


def test_every_command_and_option_has_its_place(root: Path, tmp_path: Path) -> None:
    text = "".join(commands.pages(root, tmp_path).values())
    every = [each for name, command in program.commands.items() for each in tree(name, command)]
    assert len(every) > 20
    for path, command in every:
        assert f'<a id="nlsdesign-{path.replace(" ", "-")}"></a>' in text
        options = [p for p in command.params if isinstance(p, click.Option) and not p.hidden]
        missing = [o.opts[0] for o in options if not re.search(rf"<code>[^<]*{o.opts[0]}\b", text)]
        assert not missing, f"{path}: {missing}"
    assert "austin2015_figure_consistent" in text, "examples are shown"


@pytest.mark.parametrize("name", component_classes())
def test_every_component_shows_a_deck_that_can_be_read(root: Path, name: str) -> None:
    for part in INSTANCES[name]:
        shown = parts.deck_example(part)
        assert f'component = "{name}"' in shown
        read = declare(read_deck(shown, root / f"{name}.toml"))
        assert deck_text(read).endswith(shown + "\n"), "what is shown is read back as it stands"
    assert flatten(read).parameters or part.parameters() == {}


def test_the_pages_of_parts_name_each_number_with_unit_range_and_meaning() -> None:
    for name, kind in component_classes().items():
        text = parts._part(name, kind, INSTANCES[name][:1], "")
        for number, info in kind.parameter_infos().items():
            row = re.search(rf"<tr><td><code>{number}</code></td><td>(.*?)</td><td>(.*?)</td>.*?</tr>", text)
            assert row is not None, f"{name}: {number}"
            assert row[1], f"{name}: {number} has no unit"
            assert info.description in row[0]


def test_the_first_page_installs_and_shows_what_its_code_draws(root: Path) -> None:
    page = (root / "docs" / "site" / "pages" / "index.md").read_text(encoding="utf-8")
    assert "pip install" in page[: page.index("```python")]
    made = landing.with_picture(page)
    assert made.count("<svg") == 2, "one for a desk, one for a telephone"
    first, second = re.findall(r"The cam at (\d+)°, (\d+)°", made)[0]
    assert (first, second) == ("20", "45")
    other = landing.with_picture(page.replace("[0.35, 0.79]", "[0.35, 0.7]"))
    assert "The cam at 20°, 40°" in other


def test_laws_are_typeset(root: Path) -> None:
    known = component_classes()
    lawful = [n for n, kind in known.items() if parts._laws(markup.sections(kind)[""])]
    assert len(lawful) > 0.8 * len(known)
    assert parts._laws("Hooke's law F = k·e, or T = k·θ where.") == ["F = k·e", "T = k·θ"]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("at the angle q = √(θ² + w²) − w, and so on", ["q = √(θ² + w²) − w"]),
        ("the law σ = Σ kᵢ·(⟨ε − εᵢ⟩ − ⟨−εᵢ⟩), one modulus", ["σ = Σ kᵢ·(⟨ε − εᵢ⟩ − ⟨−εᵢ⟩)"]),
        ("log₁₀ a_T = −c₁·(T − T_r)/(c₂ + T − T_r): how", ["log₁₀ a_T = −c₁·(T − T_r)/(c₂ + T − T_r)"]),
        ("while ω ≠ 0, a sign", ["ω ≠ 0"]),
        ("a table of 3 × 4 numbers, N·m/rad, and no relation.", []),
    ],
)
def test_formulas_are_found_in_prose(text: str, found: list[str]) -> None:
    assert formula.formulas(text) == found


def test_a_formula_becomes_mathml_with_its_marks_and_scripts() -> None:
    text = formula.mathml("T = T_c·e^(−t/τ) − ẋ²")
    assert "<msub><mi>T</mi><mi>c</mi></msub>" in text
    assert "<msup><mi>e</mi><mrow>" in text
    assert '<mover accent="true"><mi>x</mi><mo>˙</mo></mover>' in text
    assert text.count("<mrow>") == text.count("</mrow>")
    assert "(" not in formula.mathml("(a)[b]|c|").replace("&#", ""), "Markdown would read a link"


@pytest.mark.skipif(importlib.util.find_spec("sphinx") is None, reason="needs the extra docs")
def test_formulas_of_docstrings_are_marked_and_examples_left_alone() -> None:
    from docs.site.typeset import mark_formulas

    lines = ["The torque is T = k·θ, nothing else.", ">>> a = b", "``x = y``"]
    mark_formulas(lines)
    assert lines == ["The torque is :formula:`T = k·θ`, nothing else.", ">>> a = b", "``x = y``"]


def test_every_public_name_limit_goal_effect_material_and_source_is_listed(
    root: Path, tmp_path: Path
) -> None:
    listed = [name for _, names in api.sections(root) for name in names]
    assert sorted(listed) == sorted(set(dir(nlsdesign)) - {"__version__"})
    made = catalogue.pages(root, tmp_path)
    asked = made["reference/targets_limits_goals.md"]
    names = [name for base, _ in catalogue._BASES.values() for name in kinds(base)]
    assert len(names) > 20
    assert [n for n in names if f"### {n}\n" not in asked] == []
    effects = made["reference/effects.md"]
    assert [row.__name__ for row in ALL if f'<a id="{row.__name__}"></a>' not in effects] == []
    rubbers = materials.pages(root, tmp_path)["reference/materials.md"]
    assert [n for n in library.materials() if f"## {n}\n" not in rubbers] == []
    cited = bibliography.pages(root, tmp_path)["bibliography.md"]
    keys = [bibliography.key_of(r) for r in bibliography.references().values()]
    assert len(keys) == len(set(keys)) > 50
    assert all(f'id="{key}"' in cited for key in keys)


def test_the_gallery_says_when_each_figure_was_made(root: Path) -> None:
    made = collect.read_made()
    assert set(made) == set(study_names())
    for name, entry in made.items():
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", str(entry["date"]))
        assert f"nlsdesign study run {name}" in str(entry["command"])
        titles = entry["titles"]
        assert isinstance(titles, list)
        files = sorted((root / "docs" / "gallery").glob(f"{name}-?.svg"))
        assert len(files) == len(titles)
    assert sum(len(list(map(str, e["titles"]))) for e in made.values()) > 20  # type: ignore[call-overload]


def test_links_out_of_the_pages_lead_to_listings(root: Path) -> None:
    linked: set[str] = set()
    text = stage._text(root, root / "docs" / "architecture.md", linked)
    assert "nlsdesign/foundation/deck.py" in linked
    line = re.search(
        r'href="listings/nlsdesign/foundation/deck.py.html#L-(\d+)"><code>load_deck</code>', text
    )
    assert line is not None
    source = (root / "nlsdesign" / "foundation" / "deck.py").read_text(encoding="utf-8").splitlines()
    assert "load_deck" in source[int(line[1]) - 1]
    assert "```mermaid" not in text
    charts = re.findall("```mermaid\n(.*?)```", (root / "docs" / "architecture.md").read_text("utf-8"), re.S)
    assert text.count("<svg") == sum(max(1, chart.count("subgraph")) for chart in charts) > 1


def test_what_is_sent_to_a_journal_is_no_page_but_can_be_linked_to(root: Path) -> None:
    linked: set[str] = set()
    text = stage._text(root, root / "docs" / "testing.md", linked)
    assert "docs/paper/paper.md" in linked
    assert "listings/docs/paper/paper.md.html" in text
    assert not [name for name in stage._written(root) if name.startswith("paper/")]


def test_a_bad_site_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        '<a href="b.html">b</a><a href="#there">t</a><p id="there"></p><a href="#gone">g</a>'
        '<script src="https://cdn.example.org/x.js"></script><img src="x.svg"><a href="https://example.org">e</a>',
        encoding="utf-8",
    )
    (tmp_path / "s.css").write_text("@import 'https://fonts.example.org/f.css';", encoding="utf-8")
    assert check.problems(tmp_path) == [
        "a.html: loads https://cdn.example.org/x.js from elsewhere",
        "a.html: loads x.svg, which is not there",
        "a.html: picture x.svg has no alternative text",
        "a.html: links to b.html, which is not there",
        "a.html: links to #gone: no such place on that page",
        "s.css: loads https://fonts.example.org/f.css from elsewhere",
    ]


NARROW = """<!DOCTYPE html><meta name="viewport" content="width=device-width">
<link rel="stylesheet" href="site.css">
<style>body { margin: 0 } td, th { padding: .25rem .5rem } article { overflow-x: auto }</style><article>
<div class="table-wrapper"><table><tr><td><code>LONG</code></td><td>WORDS</td><td>LONG</td></tr></table></div>
<table class="genindextable"><tr><td style="width: 33%">LONG WORDS</td><td><a>LONG</a></td></tr></table>
</article>"""


@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
def test_tables_and_the_index_fit_a_telephone(root: Path, tmp_path: Path) -> None:
    style = (root / "docs" / "site" / "static" / "site.css").read_text(encoding="utf-8")
    (tmp_path / "site.css").write_text(style, encoding="utf-8")
    page = tmp_path / "page.html"
    long = "a_name_that_is_longer_than_" * 3
    page.write_text(NARROW.replace("LONG", long).replace("WORDS", "some words " * 9))
    with browser() as tab:
        tab.look(390)
        tab.open(page)
        assert tab.evaluate(OUT_OF_SIGHT) == []
        assert tab.evaluate("document.querySelector('article').scrollWidth") <= 390


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("furo") is None, reason="needs the extra docs")
def test_the_site_builds_without_a_warning_and_asks_for_nothing_outside(root: Path, tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "docs.site", str(tmp_path / "site")],
        cwd=root, env={**os.environ, "OMP_NUM_THREADS": "1"}, capture_output=True, text=True, timeout=600,
        check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) > 100
    assert (tmp_path / "site" / "searchindex.js").is_file()
    inner = (tmp_path / "site" / "reference" / "parts" / "core.html").read_text(encoding="utf-8")
    assert inner.count("<svg") > 5
    assert "<math" in inner
    if chromium() is None:
        return
    with browser() as tab:
        tab.look(390)
        for name in ("genindex", "discrepancy", "index", "reference/parts/core", "gallery/emps"):
            tab.open(tmp_path / "site" / f"{name}.html")
            assert tab.evaluate(OUT_OF_SIGHT) == [], name
            assert tab.evaluate("document.documentElement.scrollWidth") <= 390, name


def test_parts_are_drawn() -> None:
    part: Part = INSTANCES["BoucWen"][0]
    svg = parts.drawing("BoucWen", [part])
    assert "var(--blue)" in svg
    assert "force of BoucWen over extension" in svg
    assert parts.drawing("Encoder", INSTANCES["Encoder"]) == ""
    assert tomllib.loads(parts.deck_example(part))["part"]["component"] == "BoucWen"


def test_the_list_of_pages_marks_the_page_and_what_it_hangs_from() -> None:
    box = '<input aria-label="more" class="toctree-checkbox"/>'
    above = '<li class="toctree-l1 has-children"><a class="reference internal" href="{}">A</a>' + box
    other = '<li class="toctree-l2"><a class="reference internal" href="c.html">C</a></li></ul></li>'
    page = '<li class="toctree-l2"><a class="reference internal" href="b.html">B</a></li>'
    beside = above.format("d.html") + "<ul>" + page.replace("b.html", "e.html") + "</ul></li></ul>"
    tree = "<ul>" + beside[:-5] + above.format("a.html") + "<ul>" + page + other + "</ul>"
    marked = navigation.marked(tree, "b.html")
    here = page.replace("toctree-l2", "toctree-l2 current current-page")
    here = here.replace('"reference', '"current reference').replace("b.html", "#")
    opened = '<li class="toctree-l1 current has-children"><a class="reference internal" href="a.html">A</a>'
    assert marked == (
        '<ul class="current">' + beside[:-5] + opened + box.replace(" class", ' checked="" class')
        + '<ul class="current">' + here + other + "</ul>"
    )  # fmt: skip
    assert navigation.marked(tree, "nowhere.html") == tree
