"""A report is one valid file that needs nothing else, hides nothing, and appears whole or not at all."""

from __future__ import annotations

import base64
import hashlib
import itertools
import json
import os
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib.figure
import numpy as np
import pytest
import sympy

from nlsdesign.bench.discrepancy.reporting.verdict import Course, RecordGap, Verdict
from nlsdesign.bench.identification.residuals import Binned
from nlsdesign.components import ROTATION, Dashpot, Inertia, Spring, tie
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.errors import ExportError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import quantity
from nlsdesign.foundation.work_sharing import Processes, spread_over
from nlsdesign.model import flatten
from nlsdesign.model.flat import equations
from nlsdesign.presentation import report
from nlsdesign.presentation.report.diagnosis_sections import VerdictSection
from nlsdesign.presentation.report.mathml import formula
from nlsdesign.presentation.report.sections import prose, report_text, words
from tests import figure_samples as samples

EVIL = "\"'><img src=x onerror=alert(1)><script>alert(2)</script>&amp;"
VOID = {"meta", "link", "input", "br", "hr", "img", "wbr"}


class Page(HTMLParser):
    """What a page consists of; it must be balanced."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == [], f"not closed: {self.open}"

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attributes]
        assert len(names) == len(set(names)), f"{tag} has an attribute twice"
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag, f"</{tag}> closes something else"

    def handle_data(self, data: str) -> None:
        (self.scripts if self.open and self.open[-1] == "script" else self.texts).append(data)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]

    def values(self, name: str) -> list[str]:
        return [attributes[name] or "" for _, attributes in self.elements if name in attributes]


def swing(name: str = "swing") -> Any:
    spring, damper = Spring(stiffness=2.0, domain=ROTATION), Dashpot(damping=0.01, domain=ROTATION)
    return assembly(
        name, wheel=Inertia(inertia=1e-3), spring=tie(spring, "wheel"), damper=tie(damper, "wheel")
    )


NUMBERS = {
    "motor.inertia": quantity(5.97e-4, "kg*m^2", source="paper", spread=0.1),
    "spring.rubber.area": quantity(1.0, "cm^2", source="assumed: round number"),
    "spring.cam.lever_arm": quantity(tuple(0.1 * i for i in range(12)), "mm", source="paper"),
    "cam.elements": quantity(2.0, "1", source="assumed: seen in a photograph"),
}


def verdict(words: str = "`coulomb_friction` at the motor.") -> VerdictSection:
    table = report.TableSection(
        "Candidates", ("effect", "share"), (("coulomb_friction", 0.97), ("none", -0.02))
    )
    figure = report.FigureSection("Gap", samples.FIGURES["gap_bars"](), caption="Before and after.")
    return VerdictSection("What is missing", "named", words, parts=(table, figure))


PUBLISHED = report.PublishedNumber("rms error", 0.10, 0.083, "N*m", "Fig. 8")


def sections(folder: Path) -> list[report.Section]:
    folder.mkdir(exist_ok=True)
    (folder / "c code").mkdir(exist_ok=True)
    (folder / "c code" / "observer.c").write_text("int step;\n" * 300)
    return [
        report.NumbersSection("In short", (report.KeyNumber("error", "13.1 %", "paper 13.6 %"),)),
        report.Chapter("Actuator", "What was `declared`."),
        report.TextSection("Assembly", "Two pieces.\n\nOne cable.", drawing=str(swing())),
        report.numbers_table("Numbers", NUMBERS, folded=True),
        report.EquationsSection("Equations", equations(flatten(swing())), "In full names."),
        report.Chapter("Results"),
        report.CamSection("Cam", samples.motion(), caption="It turns.", means="Stiffer.", assumed="Rest."),
        report.FigureSection("Observer", samples.FIGURES["observer_error"](), caption="Errors."),
        report.FigureSection("Loop", samples.FIGURES["closed_loop"](), caption="Loop.", means="It follows."),
        report.comparison_table("Paper", [PUBLISHED]),
        verdict(),
        report.FileSection("Files", {folder / "c code" / "observer.c": "C", folder / "c code": "all"}),
    ]


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("report")
    path = report.write_report(
        folder / "report.html", *sections(folder), title="Published actuator", abstract="Short.",
        facts={"deck": "`austin2015`"},
    )  # fmt: skip
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(text: str) -> Page:
    return Page(text)


# --- the page -------------------------------------------------------------------------------------


def test_the_page_is_balanced_and_says_its_language(text: str, page: Page) -> None:
    assert text.startswith("<!DOCTYPE html>")
    assert page.all("html") == [{"lang": "en"}]
    assert [len(page.all(tag)) for tag in ("title", "h1", "main", "nav")] == [1, 1, 1, 1]
    with pytest.raises(AssertionError, match="closes something else"):
        Page(text.replace("</figcaption>", "", 1))


def test_nothing_is_loaded(text: str, page: Page) -> None:
    assert not {"link", "img", "iframe", "object", "embed", "base", "image", "video", "audio"} & {
        tag for tag, _ in page.elements
    }
    assert page.values("src") == []
    for link in page.values("href"):
        if not link.startswith("data:application/json"):
            assert link.startswith("#") or not re.match(r"[a-z]+:|//", link), link
    # A namespace is a name, not an address that is loaded.
    assert set(re.findall(r"https?://[^\"'\s<)]*", text)) == {"http://www.w3.org/2000/svg"}
    assert not re.search(r"@import|@font-face|url\((?!#)", text)


def test_the_browser_is_told_to_load_nothing_and_to_run_only_this_script(page: Page) -> None:
    (policy,) = (
        m["content"] or "" for m in page.all("meta") if m.get("http-equiv") == "Content-Security-Policy"
    )
    assert policy.startswith("default-src 'none';")
    (script,) = page.scripts
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy
    assert "unsafe-inline" not in policy.partition("script-src")[2].partition(";")[0]
    assert not [name for name in (n for _, a in page.elements for n in a) if name.startswith("on")]


def test_identifiers_are_unique_and_every_pointer_has_a_target(text: str, page: Page) -> None:
    ids = page.values("id")
    assert len(ids) == len(set(ids))
    pointers = [link[1:] for link in page.values("href") if link.startswith("#")]
    pointers += page.values("aria-labelledby") + page.values("data-marker")
    pointers += re.findall(r"url\(#([^)]+)\)", text)
    assert len(pointers) > 20
    assert set(pointers) <= set(ids)


def test_headings_do_not_skip_a_level(page: Page) -> None:
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    assert set(levels) == {1, 2, 3, 4}


def test_every_picture_has_words_and_every_figure_a_caption(page: Page) -> None:
    pictures = page.all("svg")
    assert len(pictures) == 8, "the three figures are drawn for a telephone too"
    assert all(
        picture.get("role") == "img" and len(picture.get("aria-label") or "") > 40 for picture in pictures
    )
    assert len(page.all("figcaption")) == len(page.all("figure")) == 4


def test_every_colour_has_a_value_in_both_themes_and_in_print(text: str) -> None:
    style = text.partition("<style>")[2].partition("</style>")[0]
    used = set(re.findall(r"var\(--([\w-]+)\)", text))
    assert {"ink", "card", "blue", "warn"} <= used
    default = style[: style.index("@media")]
    for block in (default, *re.findall(r"@media screen[^{]*\{\s*:root[^{]*\{(.*?)\}\s*\}", style, re.DOTALL)):
        assert used <= set(re.findall(r"--([\w-]+): #[0-9a-f]{6};", block))
    assert len(re.findall(r"@media screen[^{]*\{\s*:root", style)) == 2
    # Dark colours hold on screens only: paper is light.
    assert "prefers-color-scheme: dark" in style
    assert "@media print" in style


@pytest.mark.slow
def test_the_same_sections_give_the_same_bytes_and_a_small_file(text: str, tmp_path: Path) -> None:
    folder, facts = tmp_path / "report", {"deck": "`austin2015`"}
    with spread_over(Processes(2)):  # whoever draws the figures
        again = report_text(
            folder, sections(folder), title="Published actuator", abstract="Short.", facts=facts
        )
    assert again == text
    assert len(text.encode()) < 1_000_000


# --- the cam --------------------------------------------------------------------------------------


def test_the_cam_shows_one_frame_without_script_and_a_slider_with_it(page: Page) -> None:
    (figure,) = (a for a in page.all("figure") if "data-frames" in a)
    frames = json.loads(figure["data-frames"] or "")
    (slider,) = page.all("input")
    assert slider["type"] == "range"
    assert (slider["min"], slider["max"]) == ("0", str(len(frames) - 1))
    first = frames[int(slider["value"] or "")]
    parts = {a["data-part"]: a for _, a in page.elements if "data-part" in a}
    assert parts["cable"]["d"] == first["cable"]
    assert parts["cam"]["transform"] == f"rotate({first['angle']})"
    assert [float(parts["contact"][name] or "") for name in ("cx", "cy")] == first["contact"]
    # Hidden until the script shows it; labelled, so that the arrow keys say what they move.
    label = next(a for a in page.all("label") if a.get("class") == "slider")
    assert "hidden" in label
    assert page.all("noscript")
    readings = {a["data-reading"] for _, a in page.elements if "data-reading" in a}
    assert readings == {"angle", *first["words"]}


def test_the_script_touches_only_parts_that_are_there(page: Page) -> None:
    (script,) = page.scripts
    asked = set(re.findall(r'part\("(\w+)"\)', script))
    assert asked == {a["data-part"] for _, a in page.elements if "data-part" in a}
    (figure,) = (a for a in page.all("figure") if "data-frames" in a)
    frame = json.loads(figure["data-frames"] or "")[0]
    assert set(re.findall(r"frame\.(\w+)", script)) == set(frame)


# --- escaping -------------------------------------------------------------------------------------


def test_hostile_names_stay_text_everywhere(tmp_path: Path) -> None:
    (tmp_path / "a & b ' <x>.c").write_text("")
    figure = samples.figures.observer_error(samples.TIME, samples.torque(), {EVIL: samples.torque()})
    symbol = sympy.Symbol(EVIL)
    hostile = report.EquationsSection(
        EVIL, report.mathml.Equations({EVIL: symbol / 2}, {EVIL: sympy.Function(EVIL)(symbol)}, False), EVIL
    )
    page = Page(
        report_text(
            tmp_path,
            [
                report.Chapter(EVIL, EVIL),
                report.TextSection(EVIL, EVIL, drawing=EVIL),
                report.FigureSection(EVIL, figure, caption=EVIL, means=EVIL, assumed=EVIL, alternative=EVIL),
                report.TableSection(EVIL, (EVIL,), ((EVIL,),), caption=EVIL),
                report.TableSection(EVIL, (EVIL,), ((EVIL,),), caption=EVIL, folded=True),
                report.numbers_table(EVIL, {EVIL: quantity(1.0, "mm", source=EVIL)}),
                report.NumbersSection(EVIL, (report.KeyNumber(EVIL, EVIL, EVIL),)),
                report.CamSection(EVIL, samples.motion(), caption=EVIL),
                report.FileSection(EVIL, {tmp_path / "a & b ' <x>.c": EVIL}, caption=EVIL),
                VerdictSection(EVIL, "unknown", EVIL, parts=(report.TextSection(EVIL, EVIL),)),
                hostile,
            ],
            title=EVIL, abstract=EVIL, facts={EVIL: EVIL},
        )
    )  # fmt: skip
    assert not page.all("img")
    assert len(page.scripts) == 1
    assert not [name for name in (n for _, a in page.elements for n in a) if name.startswith("on")]
    assert sum(EVIL in text for text in page.texts) > 40
    assert "a%20%26%20b%20%27%20%3Cx%3E.c" in page.values("href")


def test_a_long_name_in_a_table_may_break_behind_its_dots(tmp_path: Path) -> None:
    name = "spring.cable.rubber.relaxing.dashpot.viscosity"
    section = report.TableSection("Numbers", ("number", "value"), ((name, "1.5 Pa·s"),))
    page = report.write_report(tmp_path / "r.html", section, title="t").read_text(encoding="utf-8")
    assert name.replace(".", ".<wbr>") in page
    assert "1.5 Pa·s" in page


def test_plain_text_becomes_paragraphs_and_code() -> None:
    assert words("a < `b & c`") == "a &lt; <code>b &amp; c</code>"
    assert prose("one\ntwo\n\n \n`three`") == "<p>one\ntwo</p>\n<p><code>three</code></p>"
    assert prose("") == ""


# --- sections -------------------------------------------------------------------------------------


def test_a_figure_without_words_is_refused() -> None:
    bare = matplotlib.figure.Figure()
    with pytest.raises(ValueRangeError, match=r"figure 'Bare'.*has no alternative text"):
        report.FigureSection("Bare", bare, caption="What is seen.")
    assert report.FigureSection("Bare", bare, caption="What is seen.", alternative="An empty figure.")


def test_numbers_of_a_deck_with_what_is_only_assumed() -> None:
    table = report.numbers_table("Numbers", NUMBERS)
    assert table.caption.startswith("4 numbers, of which 50 % are only assumed")
    assert table.marked == {1, 3}
    assert table.rows[0] == ("motor.inertia", "0.000597", "kg·m²", "± 10 %", "paper")
    assert table.rows[1][1:3] == ("1", "cm²")
    assert table.rows[2][1] == "12 numbers from 0 to 1.1"


def test_columns_of_numbers_stand_right(tmp_path: Path) -> None:
    rows = (("a", 1.5, "–", "12"), ("b", -2e-9, "3.1·10⁻⁷", "x"))
    page = Page(report_text(tmp_path, [report.TableSection("T", ("n", "p", "q", "r"), rows)], title="t"))
    assert [cell.get("class") for cell in page.all("th")] == [None, "number", "number", None]
    assert {"1.5", "−2·10⁻⁹"} <= set(page.texts)


def test_paper_beside_model() -> None:
    rows = [
        report.PublishedNumber("rms", 0.1, 0.083, "N*m"),
        report.PublishedNumber("rank", None, 3.0, "1", "at 0°"),
    ]
    table = report.comparison_table("Paper", rows)
    assert table.rows == (("rms", "0.100", "0.0830", "N·m", ""), ("rank", "–", "3.00", "", "at 0°"))


def test_links_to_files_are_relative_to_the_report(tmp_path: Path) -> None:
    (tmp_path / "out" / "fmu").mkdir(parents=True)
    (tmp_path / "out" / "fmu" / "plant.fmu").write_bytes(b"x" * 1_234_567)
    (tmp_path / "deck.toml").write_text("")
    files = {tmp_path / "out" / "fmu" / "plant.fmu": "plant", tmp_path / "deck.toml": "deck"}
    path = report.write_report(tmp_path / "out" / "r.html", report.FileSection("Files", files), title="t")
    page = Page(path.read_text(encoding="utf-8"))
    links = [link for link in page.values("href") if not link.startswith("#")]
    assert links == ["fmu/plant.fmu", "../deck.toml"]
    assert all((path.parent / link).is_file() for link in links)
    assert {"1.2 MB", "0 B"} <= set(page.texts)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: report.TableSection("T", ("a", "b"), (("1",),)), ValueRangeError, "row 1.*1 cells for 2"),
        (lambda: VerdictSection("V", "nmaed", "?"), UnknownNameError, "did you mean 'named'"),
        (lambda: report_text(Path(), [], title="t"), ValueRangeError, "has no section"),
        (
            lambda: report_text(Path(), [report.FileSection("F", {Path("gone.c"): ""})], title="t"),
            ExportError,
            r"gone\.c.*does not exist",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_shown_is_named(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


# --- equations ------------------------------------------------------------------------------------


def shape(expression: Any) -> str:
    """MathML as letters: what stands where, without the elements that only group."""
    root = ET.fromstring(formula(expression))

    def told(element: ET.Element) -> str:
        inner = [told(child) for child in element]
        match element.tag:
            case "mfrac":
                return f"[{inner[0]} / {inner[1]}]"
            case "msup":
                return f"{inner[0]}^{inner[1]}"
            case "msub":
                return f"{inner[0]}_{inner[1]}"
            case "msqrt":
                return f"sqrt[{''.join(inner)}]"
            case _:
                return (element.text or "") + "".join(inner)

    return told(root)


A, B, C = sympy.symbols("a.x b.y_1 c[12]", real=True)


@pytest.mark.parametrize(
    ("expression", "shown"),
    [
        (A * (A + B) / C, "[a.x⋅(a.x+b.y_1) / c_12]"),
        (-A / 3, "−[a.x / 3]"),
        (A - B, "a.x−b.y_1"),
        (-A - B, "−a.x−b.y_1"),
        (sympy.tanh(A / B), "tanh([a.x / b.y_1])"),
        (sympy.Max(0, A), "max(0,a.x)"),
        (2 * sympy.Abs(A), "2⋅|a.x|"),
        ((A + B) ** 2, "(a.x+b.y_1)^2"),
        (sympy.sqrt(A + 1), "sqrt[a.x+1]"),
        (sympy.exp(-A), "exp(−a.x)"),
        (sympy.floor(A), "⌊a.x⌋"),
        (sympy.Float(2.5e-7), "2.5⋅10^−7"),
        (sympy.Piecewise((A, A <= B), (0, True)), "{a.xwhere\u00a0a.x≤b.y_10otherwise"),
        (1 / (A * B), "[1 / a.x⋅b.y_1]"),
        (sympy.sqrt(A) / A**2, "[1 / a.x^[3 / 2]]"),
    ],
)
def test_an_equation_reads_as_it_means(expression: Any, shown: str) -> None:
    assert shape(expression) == shown


def test_a_power_keeps_the_brackets_of_its_base() -> None:
    assert shape(sympy.Pow(sympy.Pow(A, B, evaluate=False), 2, evaluate=False)) == "(a.x^b.y_1)^2"
    assert shape(sympy.Pow(-A, 3, evaluate=False)) == "(−a.x)^3"
    assert shape(A * (-B) * 2) == "−2⋅a.x⋅b.y_1"


def test_a_long_sum_wraps_and_an_unknown_function_names_a_row_once() -> None:
    arguments = sympy.symbols("motor.angle lever_arm[1] lever_arm[2]", real=True)
    given = report.mathml.Equations({"x": A + B - C}, {"h": sympy.Function("f")(*arguments)}, True)
    content = report.EquationsSection("E", given).content(report.sections.PagePosition("s1", Path()))
    plain = [
        [re.sub(r"<[^>]*>", "", piece) for piece in row] for row in (*content["states"], *content["signals"])
    ]
    assert plain[0] == ["x+=", "a.x", "+b.y_1", "−c12"]
    assert plain[1] == ["h=", "f(motor.angle,", "lever_arm,", "…)"]


def test_long_equations_can_be_folded(tmp_path: Path) -> None:
    given = report.mathml.Equations({"x": A + B}, {}, False)
    for folded in (False, True):
        section = report.EquationsSection("E", given, "Of the model.", folded=folded)
        page = report_text(tmp_path, [section], title="T")
        assert ("<summary>Of the model.</summary>" in page) == folded
        assert page.count("<details") == page.count("</details>") == int(folded)


def test_the_equations_of_a_model_stand_in_the_page(text: str) -> None:
    rows = re.findall(r'<p class="equation">(.*?)</p>', text, re.DOTALL)
    plain = [re.sub(r"\s+", "", re.sub(r"<[^>]*>", "", row)) for row in rows]
    assert "dwheel.angledt=wheel.speed" in plain
    assert "spring.torque=spring.stiffness⋅wheel.angle" in plain
    assert len(plain) == len(equations(flatten(swing())).derivatives) + len(
        equations(flatten(swing())).definitions
    )


# --- writing --------------------------------------------------------------------------------------


def test_what_is_folded_is_one_closed_entry_that_lists_its_headings(tmp_path: Path) -> None:
    inner = (report.TextSection("Parts", "All of them."), report.TextSection("Numbers", "Some."))
    page = report.write_report(tmp_path / "r.html", report.FoldedSection("More", inner), title="folded")
    text = page.read_text(encoding="utf8")
    assert re.search(r'<details class="folded">\s*<summary>Parts; Numbers</summary>', text)
    assert text.count("<details") == 1
    assert [text.count(f'id="s1{end}"') for end in ("", "-1", "-2")] == [1, 1, 1]
    assert '<h4 id="s1-1-title">Parts</h4>' in text
    assert "All of them." in text


def test_a_report_that_fails_leaves_the_old_one_alone(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    report.write_report(path, report.TextSection("One", "first"), title="t")
    before = path.read_bytes()
    with pytest.raises(ExportError):
        report.write_report(path, report.FileSection("F", {tmp_path / "gone": ""}), title="t")
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["report.html"]


def test_a_report_replaces_the_old_one_in_one_move(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "report.html"
    report.write_report(path, report.TextSection("One", "first"), title="t")
    before = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(ExportError, match="No space left on device"):
        report.write_report(path, report.TextSection("Two", "second"), title="t")
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["report.html"]


def test_a_folder_that_is_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("x")
    with pytest.raises(ExportError, match="cannot be written"):
        report.write_report(tmp_path / "taken" / "r.html", report.TextSection("One", "x"), title="t")


def test_a_missing_folder_is_made(tmp_path: Path) -> None:
    path = report.write_report(tmp_path / "a" / "b.html", report.TextSection("One", "x"), title="t")
    assert path.is_file()


def test_a_report_on_a_diagnosis_has_units_on_every_axis() -> None:
    wheel = assembly(
        "wheel", load=Inertia(inertia=1e-3), spring=tie(Spring(stiffness=2.0, domain=ROTATION), "load")
    )
    before, after = (
        Binned(np.linspace(0.0, 1.0, 5), size * np.linspace(0.1, 0.2, 5), np.zeros(5)) for size in (1.0, 0.5)
    )
    time = np.linspace(0.0, 1.0, 50)
    shapes = {"over load.angle": (before, after), "over speed": (before, after)}
    gaps = (RecordGap("load", "a", "held_out", 2.0, 1.0, 0.5, 50, "N*m", 4.0, "torque of the drive"),)
    course = Course("a", "torque of the drive", "N*m", time, time, 0.5 * time, time, 0.1)
    diagnosis = Verdict("named", (), ("load",), gaps, "load", (), wheel, wheel, course, shapes=shapes)
    sections = report.verdict_sections(diagnosis)
    drawn = [part.figure for part in sections[1].parts if isinstance(part, report.FigureSection)]  # type: ignore[attr-defined]
    labels = [axes.get_xlabel() for figure in drawn for axes in figure.axes[-1:]]
    assert labels == ["", "time in s", "load.angle in rad", "speed of the motion in rad/s"]
    for figure in drawn:
        assert [axes.get_ylabel().endswith(" in N·m") for axes in figure.axes] == [True] * len(figure.axes)
