"""Figures say what they show, look the same every time, and are right where they compute."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import to_hex
from matplotlib.text import Text

from nlsdesign.design.statics.contour import contour_from_curvature
from nlsdesign.foundation.errors import ExportError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import typeset_number
from nlsdesign.presentation import figures
from nlsdesign.presentation.figures import svg
from nlsdesign.presentation.figures.before_after import HeldOut, held_out_series
from nlsdesign.presentation.figures.cam_motion import MARKER, CamMotion, cam_motion, cam_picture
from nlsdesign.presentation.figures.style import SERIES, TONES, alternative_text, look
from nlsdesign.presentation.figures.svg import svg_text, thinned
from nlsdesign.presentation.figures.telephone import for_telephone
from tests import figure_samples as samples
from tests.figure_samples import drawn
from tests.selection import quick_only

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(autouse=True)
def no_window() -> Iterator[None]:
    """Nothing of pyplot's state is used, and the user's settings stay as they were."""
    before = dict(mpl.rcParams)
    yield
    assert pyplot.get_fignums() == []
    assert dict(mpl.rcParams) == before


# --- every figure ---------------------------------------------------------------------------------


@pytest.mark.long_cases("motor_over_task")
@pytest.mark.parametrize("name", quick_only(samples.FIGURES, list(samples.FIGURES)[::15]))
def test_a_figure_is_drawn_the_same_whatever_the_user_has_set(name: str) -> None:
    first = svg_text(drawn(name))
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 20.0, "axes.facecolor": "red"}):
        assert svg_text(samples.FIGURES[name]()) == first
    assert "<dc:date>" not in first
    assert "mathdefault" not in first, "a label of a tick is a command of a typesetter, not a number"
    assert "#ff0000" not in first


@pytest.mark.parametrize("name", samples.FIGURES)
def test_a_figure_has_words_labels_and_units(name: str) -> None:
    figure = drawn(name)
    assert len(alternative_text(figure)) > 40
    shown = [axes for axes in figure.axes if axes.get_visible()]
    if name == "cam_positions":
        assert "mm" in figure.get_supxlabel()
        return
    for axes in shown:
        if axes.get_ylabel() not in ("rank", "condition number", "damping ratio", "|difference|"):
            labelled = axes.get_ylabel() or axes.get_shared_y_axes().get_siblings(axes)[0].get_ylabel()
            assert re.search(r" in \S", labelled or axes.get_xlabel()), labelled
    bottom = shown[-1]
    assert bottom.get_xlabel() == "" if name == "gap_bars" else re.search(r" in \S", bottom.get_xlabel())


# Of each kind, for most other tests leave the figures of their pages blank: tests/undrawn.py.
@pytest.mark.parametrize("name", quick_only(samples.FIGURES, list(samples.FIGURES)[::5]))
def test_an_inline_figure_fits_into_any_page(name: str) -> None:
    figure = drawn(name)
    root = ET.fromstring(figures.inline_svg(figure, "k7"))
    assert root.tag == f"{SVG}svg"
    assert root.get("aria-label") == alternative_text(figure)
    # What an image holds is not read out, and links are.
    assert root.get("role") == ("img" if root.find(f".//{SVG}a") is None else "group")
    assert root.get("viewBox")
    text = ET.tostring(root, encoding="unicode")
    ids = re.findall(r'\bid="([^"]*)"', text)
    assert len(set(ids)) == len(ids)
    assert all(each.startswith("k7-") for each in ids)
    assert set(re.findall(r'url\(#([^)]*)\)|href="#((?!point-\d)[^"]*)"', text)) <= {(i, "") for i in ids} | {
        ("", i) for i in ids
    }
    assert re.findall(r"https?://(?!www\.w3\.org/2000/svg)", text) == []
    # What would act on the whole page is gone, and every colour follows the page.
    assert not {f"{SVG}style", f"{SVG}metadata", f"{SVG}script"} & {element.tag for element in root.iter()}
    assert re.findall(r"#[0-9a-f]{6}\b", text) == []
    assert "var(--ink" in text


@pytest.mark.parametrize("name", ["cam_positions", "margins", "tolerance_bars"])
def test_a_figure_for_a_telephone_holds_its_words_and_leaves_the_given_one_alone(name: str) -> None:
    figure = drawn(name)
    before, narrow = svg_text(figure), for_telephone(figure)
    narrow.draw_without_rendering()
    # Letters of 9 points in a picture of 353: as high on a screen 350 pixels wide.
    width, height = narrow.bbox.size
    assert width <= 353.0
    boxes = [axes.get_window_extent() for axes in narrow.axes]
    assert all(abs(box.x0 - boxes[0].x0) < 80.0 for box in boxes), "panels stand below each other"
    ticks = {label for axes in narrow.axes for label in (*axes.get_xticklabels(), *axes.get_yticklabels())}
    for text in narrow.findobj(Text):
        if text.get_text().strip() and text not in ticks:
            box = text.get_window_extent()
            assert -1.0 < box.x0 < box.x1 < width + 1.0, text.get_text()
            assert -1.0 < box.y0 < box.y1 < height + 1.0, text.get_text()
    assert svg_text(figure) == before


def test_steps_end_where_the_points_were() -> None:
    path = "M 1 2.5 L 1.1 -3 L 1.1 7.25 z M 0 0 L -0.1 0"
    assert svg._steps(path) == "M1 2.5l0.1-5.5l0 10.2zM0 0l-0.1 0"


def test_the_marker_of_the_cam_keeps_its_name() -> None:
    inline = figures.inline_svg(figures.torque_curve(samples.motion(), at=3), "k1")
    assert inline.count(f'id="k1-{MARKER}"') == 1


def test_a_hostile_label_stays_text() -> None:
    evil = '"><script>alert(1)</script>'
    figure = figures.observer_error(samples.TIME, samples.torque(), {evil: samples.torque()})
    root = ET.fromstring(figures.inline_svg(figure, "k"))
    assert not any("script" in element.tag for element in root.iter())
    assert any(evil in (element.text or "") for element in root.iter(f"{SVG}text"))
    assert evil in root.get("aria-label", "")


@pytest.mark.slow
def test_more_lines_than_colours_are_all_drawn_and_differ() -> None:
    estimates = {f"observer {i}": samples.torque() + 0.01 * i for i in range(12)}
    figure = figures.observer_error(samples.TIME, samples.torque(), estimates)
    assert len(figure.axes[0].lines) == 13
    assert len({look(i)[:2] for i in range(25)}) == 25


# --- colours --------------------------------------------------------------------------------------


def linear(colour: str) -> np.ndarray:
    values = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def contrast(one: str, other: str) -> float:
    """Contrast ratio of WCAG 2.1."""
    high, low = sorted((float(linear(c) @ [0.2126, 0.7152, 0.0722]) for c in (one, other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def lab(rgb: np.ndarray) -> np.ndarray:
    matrix = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = np.cbrt(np.clip(matrix @ rgb, 0.0, None) / [0.9505, 1.0, 1.089])
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


# Machado, Oliveira and Fernandes 2009, severity 1, on linear RGB.
BLINDNESS = {
    "none": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_lines_and_letters_stand_out_from_the_page(theme: str) -> None:
    tones = {tone.name: getattr(tone, theme) for tone in TONES}
    for name in ("ink", "muted"):
        assert contrast(tones[name], tones["surface"]) >= 4.5
    for tone in SERIES:
        assert contrast(getattr(tone, theme), tones["surface"]) >= 3.0


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("blindness", BLINDNESS)
def test_the_first_three_lines_can_be_told_apart(theme: str, blindness: str) -> None:
    seen = [lab(np.clip(BLINDNESS[blindness] @ linear(getattr(tone, theme)), 0, 1)) for tone in SERIES[:3]]
    apart = [float(np.linalg.norm(seen[i] - seen[j])) for i, j in ((0, 1), (0, 2), (1, 2))]
    assert min(apart) > 20.0, apart


# --- lines ----------------------------------------------------------------------------------------


def test_a_thinned_line_keeps_every_peak() -> None:
    x = np.linspace(0.0, 3.0, 60_013)
    y = np.sin(7 * x)
    y[[12_345, 44_444]] = [5.0, -4.0]
    few, values = thinned(x, y)
    assert len(few) <= 4 * 400
    assert np.all(np.diff(few) > 0.0)
    assert values.max() == 5.0
    assert values.min() == -4.0
    column, kept = (np.minimum((each / 3.0 * 400).astype(int), 399) for each in (x, few))
    for i in range(0, 400, 23):
        assert values[kept == i].max() == y[column == i].max()
        assert values[kept == i].min() == y[column == i].min()
    assert set(zip(few, values, strict=True)) <= set(zip(x, y, strict=True))


def test_a_thinned_loop_keeps_its_shape_and_a_short_line_is_left_alone() -> None:
    phase = np.linspace(0.0, 2 * np.pi, 50_000)
    x, y = thinned(np.cos(phase), np.sin(phase))
    assert 500 < len(x) < 5000
    assert np.max(np.hypot(np.diff(x), np.diff(y))) < 0.02
    short = np.array([0.0, 2.0, 1.0])
    assert np.array_equal(thinned(short, short)[0], short)


def test_a_gap_in_a_line_stays_a_gap() -> None:
    x = np.linspace(0.0, 1.0, 20_000)
    y = np.where((x > 0.4) & (x < 0.6), np.nan, x)
    few, values = thinned(x, y)
    assert np.isnan(values[(few > 0.41) & (few < 0.59)]).all()
    assert np.isfinite(values[(few < 0.39) | (few > 0.61)]).all()


# --- numbers --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (0.012345, 3, "0.0123"),
        (1234.5, 3, "1230"),
        (9.999, 3, "10.0"),
        (-0.5, 2, "−0.50"),
        (3.4e-9, 2, "3.4·10⁻⁹"),
        (2.5e7, 2, "2.5·10⁷"),
        (0.0, 3, "0"),
        (float("inf"), 3, "∞"),
        (99999.0, 2, "100000"),
        (1e-4, 2, "0.00010"),
    ],
)
def test_numbers_as_people_write_them(value: float, digits: int, shown: str) -> None:
    assert typeset_number(value, digits) == shown


def test_numbers_without_zeros_at_their_end() -> None:
    assert [figures.compact(v) for v in (0.25, 12.0, 1200.0, 2e-9, -0.02)] == [
        "0.25", "12", "1200", "2·10⁻⁹", "−0.02",
    ]  # fmt: skip


# --- cam ------------------------------------------------------------------------------------------


def test_the_cable_drawn_is_as_long_as_the_extension_says() -> None:
    """Inextensible cable: what is taken up on the cam is what the rubber is stretched."""
    motion = samples.motion()
    lengths = [
        float(np.sum(np.hypot(*np.diff(motion.cable(i), axis=0).T))) for i in range(len(motion.angles))
    ]
    taken_up = np.array(lengths) - lengths[motion.nearest(0.0)]
    assert motion.extensions[-1] > 4e-3
    assert np.max(np.abs(taken_up - motion.extensions)) < 5e-6


def test_the_free_cable_touches_the_cam_at_the_lever_arm() -> None:
    motion = samples.motion()
    for index in range(len(motion.angles)):
        contact, guide = motion.cable(index)[-2:]
        along = (guide - contact) / np.hypot(*(guide - contact))
        # Moment of a unit force along the cable: negative where it resists a positive angle.
        moment = contact[0] * along[1] - contact[1] * along[0]
        assert moment == pytest.approx(-motion.lever_arms[index], abs=2e-6)


def test_the_two_strokes_mirror_each_other() -> None:
    motion = samples.motion()
    for index in range(len(motion.angles)):
        other = motion.cable(len(motion.angles) - 1 - index)
        assert motion.cable(index) == pytest.approx(other * [1.0, -1.0], abs=1e-12)
    assert motion.torques == pytest.approx(-motion.torques[::-1])


def test_the_marker_runs_along_the_curve() -> None:
    motion = samples.motion()
    picture = cam_picture(motion, start=0.3)
    assert motion.angles[picture.start] == pytest.approx(0.3, abs=0.04)
    assert picture.frames[picture.start]["marker"] == [0.0, 0.0]
    shifts = np.array([frame["marker"] for frame in picture.frames])
    # Up in the figure is down in numbers; both run with angle and torque.
    across, up = shifts[:, 0] - shifts[0, 0], shifts[0, 1] - shifts[:, 1]
    assert across / across[-1] == pytest.approx(
        (motion.angles - motion.angles[0]) / np.ptp(motion.angles), abs=1e-3
    )
    assert up / up[-1] == pytest.approx(
        (motion.torques - motion.torques[0]) / np.ptp(motion.torques), abs=1e-3
    )


def test_the_rubber_ends_where_the_cable_begins() -> None:
    picture = cam_picture(samples.motion())
    for frame in picture.frames:
        x, y, width, height = frame["rubber"]
        end = [float(v) for v in frame["cable"].rpartition("L")[2].split()]
        assert end == pytest.approx([x, y + height / 2], abs=0.011)
        assert x + width == pytest.approx(picture.wall, abs=0.011)


def test_a_cam_that_cannot_be_made_says_so() -> None:
    assert samples.motion().warning == ""
    nodes = np.linspace(0.0, 1.3, 14)
    hollow = contour_from_curvature(
        nodes, np.where(nodes < 0.25, -2e-3, 9e-3), first_slope=8e-3, anchor_distance=25e-3
    )
    warning = cam_motion(hollow, lambda e: 9e3 * e, rest_length=12.5e-3).warning
    assert "concave between 0.0° and" in warning
    assert "down to −2.0 mm" in warning


def test_a_motion_needs_equal_rows() -> None:
    motion = samples.motion()
    with pytest.raises(ValueRangeError, match="one extension, force and torque for each angle"):
        CamMotion(motion.contour, motion.angles, motion.extensions[1:], motion.forces, motion.torques, 0.01)


# --- what the figures compute ---------------------------------------------------------------------


def test_the_area_of_a_loop() -> None:
    """∮ sin(t + φ) d(sin t) = π sin φ, positive where the torque leads as in any passive spring."""
    assert figures.loop_area(*samples.loop(0.3)) == pytest.approx(0.7 * 2.0 * np.pi * np.sin(0.3), rel=1e-5)
    assert figures.loop_area(*samples.loop(-0.3)) < 0.0


def test_the_errors_named_are_those_of_the_data() -> None:
    assert "cam of the deck 10 mN·m" in alternative_text(samples.against_target())
    observer = figures.observer_error(samples.TIME, samples.torque(), {"A": samples.torque() + 0.025})
    assert "A 25.0 mN·m" in alternative_text(observer)
    assert [t.get_text() for t in observer.axes[1].get_legend().get_texts()] == ["A: rms 25.0 mN·m"]


def test_angles_that_are_not_observable_are_marked() -> None:
    figure = figures.observability_over_angle({"F_M": samples.chart()})
    assert "not observable at 0.0°" in alternative_text(figure)
    crosses = [line for line in figure.axes[1].lines if line.get_marker() == "x"]
    assert [line.get_xdata().tolist() for line in crosses] == [[0.0]]
    assert figure.axes[1].get_yscale() == "log"


def test_bars_are_as_high_as_the_errors_and_held_out_records_stand_right() -> None:
    axes = drawn("gap_bars").axes[0]
    assert [t.get_text() for t in axes.get_xticklabels()] == ["steps", "slow sine", "multisine"]
    assert [bar.get_height() for bar in axes.containers[0]] == [1.4, 0.9, 1.25]
    assert [bar.get_height() for bar in axes.containers[1]] == [0.15, 0.11, 0.13]
    floors = [segment[0][1] for segment in axes.collections[0].get_segments()]
    assert floors == [0.09, 0.08, 0.085]


def test_small_errors_have_one_unit_and_shares_have_none() -> None:
    errors = [figures.RecordError("a", 1.8e-4, 1.7e-4, 1.6e-4, False)]
    axes = figures.gap_bars(errors, unit="N*m").axes[0]
    axes.figure.canvas.draw()
    ticks = [label.get_text() for label in axes.get_yticklabels()]
    assert "0.000050" in ticks
    assert axes.yaxis.get_offset_text().get_text() == ""
    assert figures.gap_bars(errors, unit="1", quantity="error over noise").axes[0].get_ylabel() == (
        "rms error over noise"
    )


def test_no_number_of_a_bar_is_struck_through_by_the_noise_floor() -> None:
    errors = [
        figures.RecordError(n, h, h, 0.25, n == "c") for n, h in (("a", 0.236), ("b", 0.27), ("c", 0.1))
    ]
    axes = figures.gap_bars(errors, unit="N").axes[0]
    heights = {text.get_text(): text.xy[1] for text in axes.texts if hasattr(text, "xy")}
    assert heights == {"0.236": 0.25, "0.270": 0.27, "0.100": 0.1}


def test_a_record_is_not_drawn_where_its_samples_do_not_count() -> None:
    time = np.concatenate([np.arange(0.0, 1.0, 0.01), np.arange(2.0, 3.0, 0.01)])
    record = HeldOut(time, np.sin(time), 0.9 * np.sin(time), np.sin(time), "force", "N")
    upper, lower = held_out_series(record).axes
    for line in (*upper.lines, *lower.lines):
        inside = (line.get_xdata() > 1.0) & (line.get_xdata() < 2.0)
        assert inside.any()
        assert np.all(np.isnan(line.get_ydata()[inside]))


def test_before_and_after_have_the_same_colours_in_every_figure() -> None:
    bars, series, binned = (drawn(n).axes[0] for n in ("gap_bars", "held_out_series", "binned_errors"))
    before, after = "#d55e00", "#0072b2"
    shown = [to_hex(container.patches[0].get_facecolor()) for container in bars.containers]
    assert shown == [before, after]
    for axes in (series, binned):
        lines = {line.get_label(): line.get_color() for line in axes.lines}
        assert (lines["before"], lines["after"]) == (before, after)


def test_errors_in_bins_have_units_for_people() -> None:
    axes = drawn("binned_errors").axes[0]
    assert axes.get_xlabel() == "motor.angle in rad"
    assert axes.get_ylabel() == "mean error in N·m"
    assert "N·m rms before" in alternative_text(drawn("binned_errors"))


def test_candidates_are_ordered_by_what_they_explain() -> None:
    axes = drawn("candidate_shares").axes[0]
    names = [t.get_text() for t in axes.get_yticklabels()]
    assert names == ["force_sensor_delay", "second_relaxation", "coulomb_friction"]
    assert "97 %, added" in [t.get_text() for t in axes.texts]


def test_exact_agreement_can_be_drawn() -> None:
    run = samples.closed_loop()
    for bound in (1e-6, None):
        figure = figures.closed_loop(run, differences={"torque": np.zeros_like(run.time)}, bound=bound)
    assert "torque: 0 at most" in [t.get_text() for t in figure.axes[2].get_legend().get_texts()]
    assert "<svg" in figures.inline_svg(figure, "k")


def test_what_cannot_be_drawn_is_named() -> None:
    with pytest.raises(ValueRangeError, match="signal 'A'"):
        figures.observer_error(samples.TIME, samples.torque(), {"A": samples.torque()[1:]})
    with pytest.raises(ValueRangeError, match="there is no record to draw"):
        figures.gap_bars([], unit="N")
    with pytest.raises(ValueRangeError, match="measured points"):
        figures.torque_against_measured({}, {})
    trace = samples.Trace(samples.TIME, {"spring.torque": samples.TIME}, {"spring.torque": "N*m"})
    with pytest.raises(UnknownNameError, match=r"did you mean 'spring\.torque'"):
        figures.closed_loop_of(
            trace,
            desired="spring.torqe",
            true="spring.torque",
            estimated="spring.torque",
            current="spring.torque",
        )


# --- files ----------------------------------------------------------------------------------------


def test_figures_are_written_as_files_of_their_own(tmp_path: Path) -> None:
    pictures = {"gap": drawn("gap_bars"), "shares": drawn("candidate_shares")}
    paths = figures.write_figures(tmp_path / "new", pictures)
    assert [path.name for path in paths] == ["gap.svg", "shares.svg"]
    root = ET.fromstring(paths[0].read_text(encoding="utf-8"))
    assert any("multisine" in (element.text or "") for element in root.iter(f"{SVG}text"))
    assert "var(--" not in paths[0].read_text(encoding="utf-8")
    (picture,) = figures.write_figures(tmp_path / "new", {"gap": pictures["gap"]}, suffix=".png")
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in (tmp_path / "new").iterdir()) == ["gap.png", "gap.svg", "shares.svg"]


def test_a_figure_is_drawn_once_for_its_file_and_for_pages_until_it_changes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    saved: list[object] = []
    monkeypatch.setattr(svg, "FigureCanvasSVG", lambda f: (saved.append(f), FigureCanvasSVG(f))[1])
    figure = samples.FIGURES["gap_bars"]()
    on_page, on_white = figures.inline_svg(figure, "k"), svg_text(figure)
    assert (figures.inline_svg(figure, "k"), len(saved)) == (on_page, 1)
    # The background is the first path.
    fills = [re.findall(r'<path[^>]*style="fill: ([^;"]*)', text)[0] for text in (on_white, on_page)]
    assert fills == ["#ffffff", "none"]
    figure.axes[0].set_title("another title")
    assert "another title" in figures.inline_svg(figure, "k")
    assert "another title" in svg_text(figure)
    assert len(saved) == 2


def test_an_unknown_format_and_a_folder_that_is_a_file_are_named(tmp_path: Path) -> None:
    pictures = {"gap": drawn("gap_bars")}
    with pytest.raises(ExportError, match=r"did you mean '\.svg'"):
        figures.write_figures(tmp_path, pictures, suffix=".svgz")
    (tmp_path / "taken").write_text("x")
    with pytest.raises(ExportError, match="cannot be written"):
        figures.write_figures(tmp_path / "taken", pictures)
    assert os.listdir(tmp_path) == ["taken"]
