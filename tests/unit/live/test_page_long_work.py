"""The live page in a browser, on demand: cloud, loop, bench records, files, designs side by side, fingers."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from nlsdesign.live.gallery import gallery_question
from tests.browser import Tab, browser, chromium
from tests.live_server import Server, running
from tests.live_session import as_csv, bench_records
from tests.unit.bench.identification.test_tables import as_hdf5, as_mat
from tests.unit.live.test_page_in_a_browser import (
    HANDLE,
    POINT,
    answered,
    resting,
    session_of,
    settled,
)

pytest.importorskip("uvicorn")
pytest.importorskip("starlette")
pytest.importorskip("websockets")
pytestmark = [
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
    pytest.mark.slow,
]

TEXT = "document.getElementById('{0}').textContent"
CHECKED = "document.getElementById('state-name').textContent.startsWith('checked')"
STALE = "document.getElementById('{0}').classList.contains('stale')"
AREA = "spring.rubber.area"
PATHS = "document.querySelectorAll('#{0} svg.chart:not(.empty) .lines path').length"


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with running() as one:
        yield one


@pytest.fixture(scope="module")
def opened(server: Server) -> Iterator[Tab]:
    with answered(server, seconds=120) as tab:
        yield tab


@pytest.fixture
def tab(opened: Tab) -> Iterator[Tab]:
    """The page at rest, without an earlier edit; nothing was written to the console meanwhile."""
    while opened.evaluate("!document.getElementById('undo').disabled"):
        click(opened, "undo")
        resting(opened)
    opened.until(CHECKED, seconds=120)
    yield opened
    assert opened.messages == []


def click(tab: Tab, name: str) -> None:
    tab.evaluate(f"document.getElementById('{name}').click()")


def move(tab: Tab, index: int, up: float) -> None:
    x, y = tab.evaluate(HANDLE.format(index))
    tab.mouse("Pressed", x, y)
    tab.mouse("Moved", x, y - up)
    tab.mouse("Released", x, y - up)
    resting(tab)


def computed(tab: Tab, run: str, words: str, text: str) -> str:
    """Press a button and wait until a text holds words."""
    click(tab, run)
    tab.until(f"{TEXT.format(text)}.includes({words!r})", seconds=180)
    return str(tab.evaluate(TEXT.format(text)))


# --- cloud and loop -------------------------------------------------------------------------------


def test_the_cloud_shows_its_quantiles_grows_old_with_an_edit_and_can_be_stopped(tab: Tab) -> None:
    words = computed(tab, "tolerance-run", "made springs: 95 %", "tolerance-state")
    assert words.startswith("200 made springs: 95 % have an rms error below ")
    assert tab.evaluate(PATHS.format("tolerance-chart")) == 3
    key = tab.evaluate("document.querySelector('#tolerance-chart .key').textContent")
    assert "90 % of the made springs" in key
    assert not tab.evaluate(STALE.format("tolerance"))
    move(tab, 3, 10)
    tab.until(f"{TEXT.format('tolerance-state')}.startsWith('Of an earlier design')")
    assert tab.evaluate(STALE.format("tolerance"))
    tab.until(CHECKED, seconds=120)
    click(tab, "tolerance-run")
    tab.until("!document.getElementById('tolerance-stop').hidden")
    click(tab, "tolerance-stop")
    tab.until(f"{TEXT.format('tolerance-state')} === 'stopped'")
    assert tab.evaluate("document.getElementById('tolerance-chart').hidden"), "of which design was it?"
    assert not tab.evaluate("document.getElementById('tolerance-run').disabled")


def test_a_curve_that_leaves_its_picture_does_not_run_along_the_edge(tab: Tab) -> None:
    path = """import("/page/chart.js").then(({ Chart }) => Chart.prototype.path.call(
      { px: (v) => v, py: (v) => -v, clipped: (v) => Math.min(10, Math.max(0, -v)), height: 10 },
      { x: [0, 1, 2, 3, 4], y: [-5, 5, 6, 7, -5] },
    ))"""
    assert tab.evaluate(path) == "M0.0 5.0L1.0 0.0M2.0 0.0M3.0 0.0L4.0 5.0"


def test_advice_of_a_check_is_done_by_its_button(tab: Tab) -> None:
    tab.evaluate(
        """(() => {
          const gallery = document.getElementById("gallery");
          gallery.value = "one_sided_cable_drive";
          gallery.dispatchEvent(new Event("change"));
        })()"""
    )
    free = "document.querySelector('#remarks button')"
    tab.until(f"{free}?.textContent === 'Free spring.cable.rope.rubber.rest_length'", seconds=120)
    tab.evaluate(f"{free}.click()")
    tab.until(f"{CHECKED} && document.getElementById('remarks').children.length === 0", seconds=120)
    for _ in range(2):
        tab.press("z", control=True)
        resting(tab)
    tab.until("document.getElementById('gallery').value === 'cam-actuator'")


LOOP = "document.querySelector('#linear-row > .card:nth-child(3)')"


def test_the_loop_at_the_angle_follows_the_slider_and_goes_with_its_design(tab: Tab) -> None:
    state = f"{LOOP}.querySelector('.job').textContent"
    curve = f"{LOOP}.querySelector('path.line')?.getAttribute('d') ?? ''"
    tab.evaluate(f"{LOOP}.querySelector('button').click()")
    tab.until(f"{state}.startsWith('Stable at ')", seconds=180)
    words, line = tab.evaluate(state), tab.evaluate(curve)
    assert "the nearest of 41 angles" in words
    assert tab.evaluate(f"{LOOP}.querySelectorAll('path.line').length") == 2
    tab.evaluate(
        """(() => {
          const slider = document.getElementById("angle");
          slider.value = 0.2 * slider.max;
          slider.dispatchEvent(new Event("input"));
        })()"""
    )
    tab.until(f"{state}.startsWith('Stable at ') && {state} !== {words!r}")
    assert settled(tab, curve, line)
    move(tab, 3, 10)
    tab.until(f"{state}.startsWith('Not computed for this design. The curve is greyed')")
    assert tab.evaluate(f"{LOOP}.classList.contains('stale')")
    assert not tab.evaluate(f"{LOOP}.querySelector('button').hidden")


# --- bench records --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Three records in three formats; wires pull at the machine that are not declared."""
    folder = tmp_path_factory.mktemp("bench")
    made = bench_records(gallery_question("cam-actuator").actuator)
    files = [folder / "run1.csv", folder / "run2.mat", folder / "run3.h5"]
    files[0].write_bytes(as_csv(made["run1"]))
    as_mat(files[1], made["run2"])
    as_hdf5(files[2], made["run3"])
    return files


STATE = TEXT.format("diagnosis-state")
BUSY = "!document.getElementById('diagnosis-stop').hidden"


def load(tab: Tab, *files: Path) -> None:
    tab.choose("records", *files)
    tab.until(f"{STATE}.endsWith({files[-1].name!r}) && !document.getElementById('diagnosis-run').disabled")


def test_a_diagnosis_is_watched_left_alone_over_a_reload_and_closes_the_gap(
    tab: Tab, records: list[Path], tmp_path: Path
) -> None:
    load(tab, *records)
    assert tab.evaluate(STATE) == "3 files are loaded: run1.csv, run2.mat, run3.h5"
    click(tab, "diagnosis-run")
    tab.until(f"{BUSY} && document.querySelectorAll('#stages li').length >= 3", seconds=120)
    session, seen = session_of(tab), tab.evaluate("document.querySelectorAll('#stages li').length")
    tab.happened.clear()
    tab.ask("Page.reload")
    tab.until("document.readyState === 'complete' && document.querySelectorAll('.point').length > 3")
    tab.until(f"{BUSY} && document.querySelectorAll('#stages li').length >= {seen}", seconds=60)
    assert session_of(tab) == session
    tab.until(f"{STATE}.startsWith('Missing in the declared machine')", seconds=300)
    assert "ravity load" in tab.evaluate(STATE)
    assert "held out records" in tab.evaluate("document.querySelector('.gap-row').textContent")
    label = tab.evaluate("document.querySelector('.gap-row svg').getAttribute('aria-label')")
    widths = [float(tab.evaluate(f"document.querySelector('.gap-row rect.{each}').getAttribute('width')"))
              for each in ("before", "after")]  # fmt: skip
    assert widths[0] == 300.0, label
    assert widths[1] < 15.0, label
    assert tab.evaluate(PATHS.format("gap")) == 2
    assert "verdict: named" in tab.evaluate("document.querySelector('#gap pre').textContent")
    # Another diagnosis of the same files can be asked for, and stopped.
    assert not tab.evaluate("document.getElementById('diagnosis-run').disabled")
    click(tab, "diagnosis-run")
    tab.until(BUSY)
    click(tab, "diagnosis-stop")
    tab.until(f"{STATE}.startsWith('stopped; 3 files are loaded')")
    assert tab.evaluate("document.querySelectorAll('.gap-row').length") == 0


def test_other_records_take_the_place_of_the_first_also_while_those_are_looked_at(
    tab: Tab, records: list[Path], tmp_path: Path
) -> None:
    load(tab, *records)
    click(tab, "diagnosis-run")
    tab.until(BUSY)
    made = bench_records(gallery_question("cam-actuator").actuator, amperes=15.0)
    others = [tmp_path / f"other{k}.csv" for k in range(3)]
    for file, columns in zip(others, made.values(), strict=True):
        file.write_bytes(as_csv(columns))
    load(tab, *others)
    tab.until(f"!({BUSY})")
    assert tab.evaluate("document.querySelectorAll('.gap-row').length") == 0
    assert tab.evaluate(STATE) == "3 files are loaded: other0.csv, other1.csv, other2.csv"
    computed(tab, "diagnosis-run", "The records themselves are in doubt", "diagnosis-state")
    assert "the declared cam ends" in tab.evaluate("document.querySelector('#gap pre').textContent")
    # The verdict is of the machine that was declared then.
    tab.evaluate(
        """(() => {
          const field = document.querySelector("#sizes input[type=text]:not(:disabled)");
          field.value = String(1.05 * Number(field.value));
          field.dispatchEvent(new Event("change"));
        })()"""
    )
    tab.until(f"{STATE}.startsWith('Of other records or another machine')")
    assert tab.evaluate(STALE.format("gap"))
    click(tab, "undo")
    tab.until(f"{STATE}.startsWith('The records themselves are in doubt')")
    assert not tab.evaluate(STALE.format("gap"))


# --- files ----------------------------------------------------------------------------------------


def saved(tab: Tab, kind: str, folder: Path) -> Path:
    """Save a file by its entry of the menu, and return it once it is whole."""
    before = set(folder.iterdir())
    tab.evaluate(f"document.querySelector('[data-file={kind}]').click()")
    tab.until(f"!document.querySelector('[data-file={kind}]').disabled", seconds=180)
    while not (new := [each for each in set(folder.iterdir()) - before if each.suffix != ".crdownload"]):
        tab.evaluate("new Promise((done) => setTimeout(done, 50))")
    (file,) = new
    return file


def test_files_are_saved_and_a_saved_design_is_opened_again(tab: Tab, tmp_path: Path) -> None:
    folder = tmp_path / "downloads"
    folder.mkdir()
    tab.downloads_to(folder)
    move(tab, 2, 12)
    tab.until(CHECKED, seconds=120)
    error = tab.evaluate("document.querySelectorAll('#numbers dd')[1].textContent")
    point = tab.evaluate(POINT.format(2))
    files = {kind: saved(tab, kind, folder) for kind in ("design", "deck", "svg", "dxf", "c", "fmu")}
    for kind, name in (
        ("design", "design.zip"),
        ("svg", "cam.svg"),
        ("dxf", "cam.dxf"),
        ("fmu", "plant.fmu"),
    ):
        assert files[kind].name == name
    with zipfile.ZipFile(files["design"]) as archive:
        assert archive.testzip() is None
    move(tab, 3, 20)
    tab.until(CHECKED, seconds=120)
    assert tab.evaluate("document.querySelectorAll('#numbers dd')[1].textContent") != error
    damaged = tmp_path / "damaged.zip"
    damaged.write_bytes(files["design"].read_bytes()[:-40])
    other = tab.evaluate(POINT.format(3))
    tab.choose("open", damaged)
    tab.until("document.getElementById('notice').textContent.includes('no archive')")
    assert tab.evaluate(POINT.format(3)) == other
    assert [each for each in tab.messages if "status of 422" not in each] == []
    tab.messages.clear()
    computed(tab, "tolerance-run", "made springs: 95 %", "tolerance-state")
    click(tab, "keep")
    tab.until("document.querySelectorAll('#compare-table thead th').length === 3")
    tab.choose("open", files["design"])
    tab.until(f"{POINT.format(3)} !== {other!r}")
    assert tab.evaluate(POINT.format(2)) == point
    tab.until(CHECKED, seconds=120)
    assert tab.evaluate("document.querySelectorAll('#numbers dd')[1].textContent") == error
    # What was computed of the design before is not that of this one; what was kept stays.
    assert tab.evaluate(TEXT.format("tolerance-state")).startswith("Made springs differ")
    assert tab.evaluate("document.getElementById('tolerance-chart').hidden")
    assert [row[1:] for row in cells(tab) if row[0] == "design"] == [["design 1", "now"]]
    tab.evaluate("document.querySelector('#compare-table thead button').click()")
    tab.choose("open", files["deck"])
    tab.until("document.getElementById('notice').hidden && document.getElementById('gallery').value === ''")
    assert tab.evaluate("document.getElementById('gallery').options[0].textContent").startswith("own deck: ")
    for expected in (None, other):
        click(tab, "undo")
        resting(tab)
        assert expected is None or tab.evaluate(POINT.format(3)) == expected, "to open is a step back"


# --- side by side ---------------------------------------------------------------------------------


def cells(tab: Tab) -> list[list[str]]:
    return list(
        tab.evaluate(
            "[...document.querySelectorAll('#compare-table tr')]"
            ".map((row) => [...row.children].map((each) => each.textContent.replace('×', '').trim()))"
        )
    )


def test_designs_stand_side_by_side_with_their_rubber_and_stay_over_a_reload(tab: Tab) -> None:
    click(tab, "keep")
    tab.until("document.querySelectorAll('#compare-table thead th').length === 3")
    tab.evaluate(
        """(() => {
          const rubber = document.getElementById("material");
          rubber.value = "Dragon_Skin_30";
          rubber.dispatchEvent(new Event("change"));
        })()"""
    )
    tab.until("document.getElementById('compare-table').textContent.includes('Dragon_Skin_30')", seconds=60)
    table = {row[0]: row[1:] for row in cells(tab)}
    assert table["design"] == ["design 1", "now"]
    assert len(set(table["actuator"])) == 1
    assert table["rubber of the library"] == ["that of the deck", "Dragon_Skin_30"]
    assert len(set(table["spring.pretension"])) == 1, "at rest both are at their largest lasting strain"
    assert len(set(table["torque error, exact numbers"])) == 2
    assert tab.evaluate(PATHS.format("compare-chart")) == 2
    tab.happened.clear()
    tab.ask("Page.reload")
    tab.until("document.querySelectorAll('#compare-table thead th').length === 3", seconds=60)
    assert {row[0]: row[1:] for row in cells(tab)}["rubber of the library"] == table["rubber of the library"]
    tab.until("document.querySelector('#compare-table thead button') !== null")
    tab.evaluate("document.querySelector('#compare-table thead button').click()")
    tab.until("document.getElementById('compare').hidden")


# --- packages of one's own ------------------------------------------------------------------------


LIBRARY_RUBBER = 'material = "PMC-770"'
GENT = """
[spring.rubber.stiff]
component = "Gent"
shear_modulus = {value = 0.5, unit = "MPa", source = "assumed: example", spread = 0.1}
limit = {value = 30.0, unit = "1", source = "assumed: example"}
"""


def test_a_law_of_ones_own_reaches_the_check_and_the_cloud(root: Path, tmp_path: Path) -> None:
    lab = root / "examples" / "rubber_lab"
    (tmp_path / "mine.py").write_bytes((lab / "src" / "rubber_lab" / "laws.py").read_bytes())
    deck = (root / "models" / "templates" / "cam-actuator.toml").read_text(encoding="utf-8")
    assert LIBRARY_RUBBER in deck
    (tmp_path / "own.toml").write_text(deck.replace(LIBRARY_RUBBER, "") + GENT, encoding="utf-8")
    with running("own.toml", before=("--with", "mine.py"), folder=tmp_path) as server, browser() as tab:
        tab.look(1400)
        tab.visit(server.address)
        tab.until(f"{TEXT.format('gallery')}.includes('own deck')", seconds=60)
        tab.until("document.getElementById('gallery').value === ''")
        tab.until(CHECKED, seconds=180)
        computed(tab, "tolerance-run", "made springs: 95 %", "tolerance-state")
        assert tab.evaluate("document.getElementById('notice').hidden")
        assert tab.messages == []


def test_a_record_a_ratio_and_a_stock_by_hand(tab: Tab, tmp_path: Path) -> None:
    """What the page takes beside the curve, and what the mechanism shows once it is checked."""
    assert tab.evaluate("document.querySelectorAll('#mechanism-world .hole').length") >= 4
    assert "cam radius" in tab.evaluate("document.querySelector('.mechanism .sizes').textContent")
    file = tmp_path / "squat.csv"
    rows = (
        f"{k / 100},{0.3 * math.sin(k * math.pi / 50)},{0.3 * math.sin(k * math.pi / 50)}\n"
        for k in range(101)
    )
    file.write_text("time_s,angle_rad,torque_Nm\n" + "".join(rows), encoding="utf-8")
    tab.evaluate("document.querySelector('#task input[type=file]').id = 'own'")
    tab.choose("own", file)
    tab.until("document.querySelector('#task select').value === 'squat.csv'")
    assert tab.evaluate("[...document.querySelectorAll('#task .task label')][0].hidden"), (
        "no body mass is asked for"
    )
    tab.evaluate(
        "(() => { const field = document.querySelectorAll('#task .given input')[1];"
        " field.value = '20'; field.dispatchEvent(new Event('change')); })()"
    )
    take = "[...document.querySelectorAll('#task button')].find((one) => /^Put/.test(one.textContent))"
    tab.until(f"!{take}.hidden")
    tab.evaluate(f"{take}.click()")
    tab.until(f"{take}.hidden")
    resting(tab)
    tab.evaluate(
        "(() => { const [size, values] = document.querySelectorAll('#stock select, #stock input[type=text]');"
        f" size.value = '{AREA}'; size.dispatchEvent(new Event('change')); values.value = '40 50';"
        " document.getElementById('stock-rubbers').checked = false;"
        " document.querySelector('#stock .task button').click(); })()"
    )
    tab.until("document.querySelectorAll('#stock tbody tr').length === 2", seconds=120)
    tab.evaluate("document.querySelectorAll('#stock tbody button')[1].click()")
    resting(tab)
    number = (
        "[...document.querySelectorAll('#sizes .control')].find((one) => one.textContent.includes('.area'))"
    )
    tab.until(f"{number}.querySelector('input').value === '50'")
