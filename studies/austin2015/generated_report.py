"""Sections on the diagnosed actuator under code from three decks."""

from __future__ import annotations

import nlsdesign as nls
from nlsdesign.presentation.report import Chapter, FigureSection, FoldedSection, Section, TableSection

from .generated import AMPLITUDE, FREQUENCY, GeneratedCode


def generated_sections(generated: GeneratedCode) -> list[Section]:
    """Show what the deck behind the code is worth."""
    return [
        Chapter(
            "What the deck behind the code is worth",
            "The machine is the actuator as the diagnosis left it, under code from its own deck, from the "
            "published one, and from the designed one, whose spring it does not have. Code names its deck by "
            "the digest in the table; `nlsdesign export check` compares them.",
        ),
        _table(generated),
        FoldedSection("One run", (_figure(generated),)),
    ]


def _table(generated: GeneratedCode) -> TableSection:
    rows = tuple(
        (
            deck,
            kind,
            each.origin.digest[:12],
            f"{1e3 * each.torque_error:.0f}" if each.settled else "none",
            f"{1e3 * each.estimate_error:.0f}" if each.settled else "none",
            f"{each.peak_current:.1f}",
        )
        for (deck, kind), each in generated.under.items()
    )
    return TableSection(
        "Torque errors under code from three decks",
        ("code from", "observer", "digest of the deck", "torque, mN·m", "estimate, mN·m", "current, A"),
        rows,
        caption=f"Sine of {AMPLITUDE:g} N·m at {FREQUENCY:g} Hz wanted, rms over the last cycle: spring "
        "torque less wanted, estimated less spring torque; peak of the current. `best` has the least "
        "expected error over the spread of its deck; the gains are the defaults. Where the numbers of the "
        "deck hold, the cascade errs less: the diagnosed deck keeps its declared spreads, though records "
        "know better.",
    )


def _figure(generated: GeneratedCode) -> FigureSection:
    runs = {deck: each.run for (deck, kind), each in generated.under.items() if kind == "cascade"}
    first = next(iter(runs.values()))
    shown = first.time >= first.time[-1] - 1.0 / FREQUENCY
    lines = {
        f"code from the {name} deck": (run["observer.spring.torque"] - run["plant.spring.torque"])[shown]
        # What the figure is about comes first: the code from the diagnosed deck.
        for name, run in sorted(runs.items(), key=lambda item: item[0] != "diagnosed")
    }
    return FigureSection(
        "Error of the estimated torque under code from three decks",
        nls.figures.over_time(first.time[shown], lines, quantity="estimated less true torque", unit="N*m"),
        caption="The last cycle of the sine, observed by the cascade.",
        means="What the code does not know of its machine, here the second relaxation and refitted numbers, "
        "or the whole spring, it puts into the torque.",
        assumed="The diagnosed actuator stands for the machine; its records are simulated.",
    )
