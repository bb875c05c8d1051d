"""The report of the comparison of rubbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.presentation.report import Chapter, FigureSection, Section, TableSection, TextSection

from .hysteresis import ALLOWED, WRONG, Hysteresis
from .merits import AT, GAIN_MARGIN, HELD, HIGH, METRICS, Merits
from .ranking import PUBLISHED, RESOLUTION, Ranking

MEAN_RANK = "mean rank, without the volume"
_WAYS = {
    "static": "static torque curve",
    "wrong": f"observer, loss {WRONG:.0%} off",
    "exact": "observer, loss exact",
}


def write(out: Path, merits: Sequence[Merits], rankings: Mapping[str, Ranking], errors: Hysteresis) -> None:
    """Write the report."""
    nls.write_report(
        out / "report.html",
        _conditions(merits),
        Chapter("The order of the rubbers"),
        _intervals(rankings),
        _order(rankings),
        _over_published(rankings),
        _designs(merits),
        Chapter("What an observer cures"),
        *_hysteresis(errors),
        _verdicts(merits, errors),
        title="Which rubber?",
        abstract="The spring of the published actuator, designed anew for every rubber of the library whose "
        "loss is known. The torque curve is the same in all; what differs is what the rubber does in motion.",
    )


def _conditions(merits: Sequence[Merits]) -> Section:
    starred = [m.candidate.label for m in merits if not m.candidate.own_curve]
    text = (
        "For each rubber cam, pretension, section and rest length are designed for 5 N·m at 53° with the "
        "same limits. The elastic curve of the library is taken as that of equilibrium; the loss tangent is "
        "flat from 0.1 to 10 Hz within 5 %. The observer takes the middle of the range for the loss; the "
        f"gain of each made spring is 1/{GAIN_MARGIN:g} of that at which the loop begins to limit-cycle "
        "while it holds "
        f"{', '.join(f'{torque:g}' for torque in HELD)} N·m.\n\n"
        "Over the draws the loss tangent is distributed evenly over its range, and the modulus normally with "
        "its spread, 15 % where none is known. Each made spring is weighed once, so observer and gain know "
        "its modulus, not its loss. The ranges are the lowest grade of evidence: no measurement stands "
        "behind them, and the probabilities are no better than they are."
    )
    if starred:
        text += (
            f"\n\n{', '.join(starred)}: the library has no elastic curve, that of unfilled natural rubber "
            "stands in. Sizes of these are not compared."
        )
    return TextSection("What is compared", text)


def _intervals(rankings: Mapping[str, Ranking]) -> Section:
    shown = {metric: rankings[metric] for metric in METRICS}
    groups = {
        METRICS[metric]: dict(zip(ranking.labels, ranking.values, strict=True))
        for metric, ranking in shown.items()
    }
    missed = next(iter(shown.values())).missed
    best = {ranking.labels[0] for ranking in shown.values() if ranking.labels}
    figure = nls.figures.ranked_intervals(
        groups,
        missed=missed,
        words=f"Figures of merit of the rubbers; first in one of them: {', '.join(best)}.",
    )
    return FigureSection(
        "Figures of merit",
        figure,
        caption="Best on top. Point: median over the draws; line: nine of ten draws.",
        means="The torque curve at rest is the same for all. A rubber with more loss is stiffer in motion, "
        "so its loop takes less gain: less bandwidth, more impedance.",
        assumed="* has the elastic curve of another rubber.",
    )


def _order(rankings: Mapping[str, Ranking]) -> Section:
    rows = tuple(
        (
            METRICS.get(metric, MEAN_RANK),
            *(ranking.labels[:2] if len(ranking.labels) > 1 else ("–", "–")),
            _percent(ranking.best[0]) if len(ranking.best) else "–",
            _percent(ranking.first_two),
            _percent(ranking.skewed),
        )
        for metric, ranking in rankings.items()
    )
    return TableSection(
        "How probable the order is",
        ("by", "first", "second", "first is best", "first two", "skewed"),
        rows,
        caption="Probabilities that the first is the best of all, that the first two are in this order, and "
        "the same where small losses are more probable (evenly over the logarithm). 50 % is a toss-up; a "
        f"difference of two figures is known to {RESOLUTION:.0%}, one standard deviation.",
    )


def _over_published(rankings: Mapping[str, Ranking]) -> Section:
    names = [name for name in rankings["mean_rank"].labels if name != PUBLISHED]
    columns = {
        metric: dict(zip(r.labels, r.over_published, strict=True))
        for metric, r in rankings.items()
        if metric != "mean_rank"
    }
    rows = tuple(
        (name, *(_percent(each.get(name, float("nan"))) for each in columns.values())) for name in names
    )
    return TableSection(
        f"Better than {PUBLISHED}",
        ("rubber", *(metric.replace("_", " ") for metric in columns)),
        rows,
        caption="Probability that each rubber is better than that of the published actuator.",
    )


def _designs(merits: Sequence[Merits]) -> Section:
    rows = tuple(
        (
            m.candidate.label,
            "met" if m.met else "missed",
            "–" if m.design is None else f"{1e3 * m.design.rms:.3g}",
            "–" if m.design is None else f"{1e6 * m.design.values['spring.rubber.area'].number:.0f}",
            "–" if m.design is None else f"{1e3 * m.design.values['spring.rubber.rest_length'].number:.1f}",
            "–" if m.design is None else f"{1e3 * m.design.values['spring.pretension'].number:.2f}",
            f"{m.proportional:.1f}" if m.met else "–",
            f"{m.candidate.loss.lower:g} to {m.candidate.loss.upper:g}, "
            f"{m.candidate.loss.known.evidence} of {m.candidate.loss.of}",
        )
        for m in merits
    )
    return TableSection(
        "The designs",
        ("rubber", "target", "mN·m", "mm²", "mm", "by mm", "Kp", "loss tangent"),
        rows,
        caption="Rms torque error at rest; section, rest length and pretension; gain in rad/s per N·m.",
    )


def _hysteresis(errors: Hysteresis) -> list[Section]:
    static, wrong = errors.threshold("static"), errors.threshold("wrong")
    x = errors.loss_tangents
    limit = {f"{ALLOWED:.0%}, taken for good": (x, np.full(len(x), 100.0 * ALLOWED))}
    return [
        FigureSection(
            "Error of the torque estimate over the loss",
            nls.figures.curves(
                {_WAYS[kind]: (x, 100.0 * errors.estimate[kind]) for kind in _WAYS} | limit,
                across="loss tangent",
                up="estimate error, % of torque",
                words="Error of the torque estimate over the loss tangent for the static curve, an observer "
                "whose loss is off, and an exact one.",
            ),
            caption=f"{HIGH} N·m at {AT:g} Hz, rms over rms, the spring of {PUBLISHED} with the loss of the "
            "axis.",
            means=f"The static curve is good up to a loss tangent of {_number(static)}, an observer whose "
            f"loss is {WRONG:.0%} off up to {_number(wrong)}; one that knows it, everywhere.",
            assumed=f"An error of {ALLOWED:.0%} is taken for good.",
        ),
        FigureSection(
            "Tracking error over the loss",
            nls.figures.curves(
                {_WAYS[kind]: (x, 100.0 * errors.tracking[kind]) for kind in _WAYS},
                across="loss tangent",
                up="tracking error, % of torque",
                words="Tracking error over the loss tangent: static curve, wrong and exact observer.",
            ),
            caption="As above, torque less what was wanted. The gain falls with the loss by the same rule.",
            means="Most of it is the lag of the loop; what the estimate does not know comes on top.",
        ),
        FigureSection(
            "Energy lost over the loss",
            nls.figures.curves(
                {_WAYS[kind]: (x, 100.0 * errors.lost[kind]) for kind in ("static", "exact")},
                across="loss tangent",
                up="energy lost per cycle, %",
                words="Energy lost per cycle over the loss tangent, static curve and exact observer: alike.",
            ),
            caption="Of the energy that is put into the spring.",
            means="An observer knows the torque, it does not change the rubber: the energy that becomes "
            "heat stays, and so does the stiffness in motion that bounds the gain. Only another rubber cures "
            "those.",
        ),
    ]


def _verdicts(merits: Sequence[Merits], errors: Hysteresis) -> Section:
    rows = tuple(_verdict(m, errors) for m in merits if m.met)
    return TableSection(
        "Observer or another rubber",
        ("rubber", "static curve, %", "observer, %", "energy lost, %", "what to do"),
        rows,
        caption="Largest error of the torque estimate over the range of the loss, in % of the torque: of the "
        "static curve, by the figure above, and of the observer with the middle of the range; energy lost "
        "per cycle at the upper end.",
    )


def _verdict(m: Merits, errors: Hysteresis) -> tuple[str, ...]:
    upper, x = m.candidate.loss.upper, errors.loss_tangents
    known = upper <= x[-1]
    static = float(np.interp(upper, x, errors.estimate["static"])) if known else np.inf
    lost = (
        f"{100 * np.interp(upper, x, errors.lost['exact']):.0f}"
        if known
        else f"> {100 * errors.lost['exact'][-1]:.0f}"
    )
    observer = 1e-3 * float(np.max(m.values["estimate_error"][[0, 2], 1])) / (HIGH / np.sqrt(2.0))
    if static <= ALLOWED:
        what = "the static curve is good enough"
    elif observer <= ALLOWED:
        what = "an observer cures the error of the torque"
    else:
        what = "measure its loss for the observer, or take another rubber"
    shown = f"{100 * static:.1f}" if known else f"> {100 * errors.estimate['static'][-1]:.0f}"
    return m.candidate.label, shown, f"{100 * observer:.1f}", lost, what


def _percent(value: float) -> str:
    return "–" if not np.isfinite(value) else f"{100 * value:.0f} %"


def _number(value: float) -> str:
    return "beyond what was tried" if not np.isfinite(value) else f"{value:.2f}"
