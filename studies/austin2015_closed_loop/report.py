"""The page of the study: each figure beside the published points, and the table of statements."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.presentation.figures import Figure, PointPanel
from nlsdesign.presentation.report import Chapter, FigureSection, Section, TableSection, write_report

from .._published import figure_points
from .benches import DECKS, FILES, NONLINEAR, SOFT
from .felt_torque import FeltTorque
from .followed_torque import AMPLITUDES, GENTLE, LATE_TORQUE, FollowedTorque
from .scheduled_law import GOALS, ScheduledLaw
from .statement import Statement
from .statements import static_torque

ACROSS = "frequency in Hz"
NOT_PRINTED = (
    "Gains and amplitude of the load are not printed in the paper. Observer with exact numbers, encoders of "
    "13 bit, 1 kHz, one sample of computation."
)


def write_page(
    out: Path, felt: FeltTorque, followed: FollowedTorque, *, law: ScheduledLaw,
    statements: tuple[Statement, ...],
) -> None:  # fmt: skip
    """Write figures and report."""
    shown = figure_sections(felt, followed)
    nls.figures.write_figures(out, {name: section.figure for name, section in shown.items()})
    sections: list[Section] = [
        TableSection(
            "What becomes of each statement",
            ("statement", "outcome", "what decides it"),
            tuple((s.stated, s.outcome, s.why) for s in statements),
            caption="Statements of the paper and of design notes, each run as a loop.",
        ),
        *shown.values(),
        _deviations(followed),
        _law(law),
    ]  # fmt: skip
    for statement in statements:
        sections += [
            Chapter(statement.stated, f"{statement.outcome.capitalize()}. {statement.why}"),
            TableSection("Loops that were run", ("loop", "outcome"),
                         tuple((t.loop, t.outcome) for t in statement.trials),
                         caption="Gains in rad/s per N·m; magnitudes are those of desired to actual torque."),
        ]  # fmt: skip
    sections.append(_points(followed))
    write_report(out / "report.html", *sections, title="Torque loop of the published actuator")


def figure_sections(felt: FeltTorque, followed: FollowedTorque) -> dict[str, FigureSection]:
    """Return Figs 8, 9 and 10 beside the published points, by the name of their file."""
    return {
        "fig08": FigureSection("Fig. 8", _torque(NONLINEAR),
                               caption="Torque at rest; marks are the published points."),
        "fig08_soft": FigureSection("Fig. 8, soft spring", _torque(SOFT), caption="A line of 1.7 N·m/rad."),
        "fig09": FigureSection(
            "Fig. 9", _felt(felt),
            caption="Lines are simulated, marks published; a cross at the lower edge is a loop that does not "
            "settle. Left Kp 64, Ki 110 (linear), Kp 135, Ki 100 (nonlinear), ±20°. Right Kp 32, Ki 50 and "
            "Kp 70, Ki 100, ±10°, the torque 8 ms late.",
            means="To 2 Hz all is gain and amplitude. Above, a late torque lifts the linear springs to their "
            "points; the rise of the nonlinear one beyond 6 Hz is not reproduced.",
            assumed=NOT_PRINTED,
        ),
        **{f"fig10_{a}": _section(_followed(followed, a), a) for a in AMPLITUDES},
    }  # fmt: skip


def _torque(spring: str) -> Figure:
    points = figure_points(f"fig08_torque_profile_{FILES[spring]}")
    angles = np.linspace(points[0, 0], points[-1, 0], 60)
    model = {spring: (angles, static_torque(spring, angles))}
    return nls.figures.torque_against_measured(model, {"published": (points[:, 0], points[:, 1])})


def _felt(felt: FeltTorque) -> Figure:
    points = {s: (p[:, 0], p[:, 1]) for s, p in felt.points.items()}
    panels = [
        PointPanel(
            title, "torque in N·m rms", {s: (r.frequency, r.rms) for s, r in shown.items()}, points,
            logarithmic=True,
        )
        for title, shown in (("Torque at once, ±20°", felt.prompt), ("Torque 8 ms late, ±10°", felt.late))
    ]  # fmt: skip
    return nls.figures.curves_beside_points(
        panels, across=ACROSS, columns=2,
        words="Torque that a moved load feels over frequency for three springs, simulated and published. To "
        "2 Hz they agree; the nonlinear spring's published rise beyond 6 Hz is not met.",
    )  # fmt: skip


def _followed(followed: FollowedTorque, amplitude: str) -> Figure:
    shown = (GENTLE, LATE_TORQUE)
    panels = []
    for column, up in ((1, "magnitude in dB"), (2, "phase in degrees")):
        for setting in shown:
            each = {s: followed[setting.name, amplitude, s] for s in DECKS}
            panels.append(
                PointPanel(
                    setting.name if column == 1 else "",
                    up,
                    {
                        s: (f.response.frequency, f.decibel if column == 1 else f.phase)
                        for s, f in each.items()
                    },
                    {s: (f.published[:, 0], f.published[:, column]) for s, f in each.items()},
                )
            )
    return nls.figures.curves_beside_points(
        panels, across=ACROSS, columns=2,
        words=f"Desired to actual torque at {AMPLITUDES[amplitude]:g} N·m of three springs, simulated with 2 "
        "settings and published: magnitude above, phase below.",
    )  # fmt: skip


def _section(picture: Figure, amplitude: str) -> FigureSection:
    means = (
        "A torque that comes 6 ms late, and is recorded late, has the published phases within 2 to 5° rms; "
        "one that comes at once misses the soft and the nonlinear spring by 12 to 18°, not the stiff."
        if amplitude == "low"
        else "At this amplitude the published phases are those of a loop whose torque comes at once."
    )
    return FigureSection(
        f"Fig. 10, {AMPLITUDES[amplitude]:g} N·m", picture,
        caption="Lines are simulated, marks published; a cross is a loop that does not settle.",
        means=f"{means} No single delay meets both amplitudes. "
        "No setting tried has the magnitude of the nonlinear spring beyond 3 Hz.",
        assumed=NOT_PRINTED,
    )  # fmt: skip


def _deviations(followed: FollowedTorque) -> TableSection:
    rows = []
    for (setting, amplitude, spring), one in followed.items():
        db, degrees = one.deviation
        lost = f"{one.lost} of {len(one.published)}"
        rows.append((setting, AMPLITUDES[amplitude], spring, db, degrees, lost))
    return TableSection(
        "Fig. 10: rms deviation from the published points",
        ("setting", "N·m", "spring", "dB", "degrees", "points without a settled answer"),
        tuple(rows),
        caption="Over the points at which the loop settles.",
    )


def _law(law: ScheduledLaw) -> TableSection:
    rows = tuple((f"{f:g} Hz", error, GOALS[f], str(verdict)) for f, (error, verdict) in law.errors.items())
    return TableSection(
        "Speed by tangent stiffness, 2.8 N·m",
        ("sine", "error over desired torque", "goal", "verdict"),
        rows,
        caption=f"Exact plant. Over the spread: {'. '.join(str(each) for each in law.spreads)}.",
    )


def _points(followed: FollowedTorque) -> TableSection:
    rows = []
    for (setting, amplitude, spring), one in followed.items():
        for k, verdict in enumerate(one.response.verdicts):
            f, db, degrees = one.published[k]
            rows.append(
                (setting, AMPLITUDES[amplitude], spring, f, db, degrees,
                 f"{one.decibel[k]:.2f}" if verdict.holds else "–",
                 f"{one.phase[k]:.1f}" if verdict.holds else "–", str(verdict))
            )  # fmt: skip
    return TableSection(
        "Fig. 10, point by point",
        ("setting", "N·m", "spring", "Hz", "published dB", "published °", "dB", "°", "verdict"),
        tuple(rows),
        caption="Each published point beside the simulated one.",
        folded=True,
    )
