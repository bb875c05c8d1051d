"""Make the figures of the paper of 2015 that this project claims, and the folder of our own paper.

``python -m docs.site.paper FOLDER`` computes them with the code of the studies and draws them with theirs,
each beside the points that were read off the published figure. The folder then holds ``report.html``, a
picture of each figure, and text and bibliography of ``docs/paper``, ready to be sent. ``--write`` renews the
pictures in ``docs/paper`` that its text shows.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import nlsdesign as nls
from nlsdesign.foundation.text_files import write_text
from nlsdesign.presentation.report import FigureSection, Section, TextSection
from studies._published import declared_actuator
from studies.audit_published_model.figures import findings
from studies.austin2015.figures import compare_with_figures
from studies.austin2015.report import figure_sections as static_sections
from studies.austin2015_closed_loop.felt_torque import felt_torque
from studies.austin2015_closed_loop.followed_torque import followed_torque
from studies.austin2015_closed_loop.report import figure_sections as loop_sections

PAPER = Path(__file__).resolve().parents[1] / "paper"
TITLES = {
    "fig01": "Fig. 1: hysteresis",
    "fig06": "Fig. 6, measured",
    "fig06_static": "Fig. 6, 45°, without any hysteresis",
    "fig08": "Fig. 8: torque over angle",
}
"""Titles that figures at rest have in the studies, by the name of the picture."""
_PICTURE = re.compile(r"!\[[^\]]*\]\((?P<file>[^)\s]+)\)")


def main() -> int:
    """Make the folder; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m docs.site.paper", description=__doc__)
    parser.add_argument("out", type=Path, nargs="?", default=Path("out/paper"), help="folder that is written")
    parser.add_argument("--fast", action="store_true", help="fewer frequencies, within seconds")
    parser.add_argument("--write", action="store_true", help="renew the pictures of docs/paper")
    arguments = parser.parse_args()
    out: Path = arguments.out
    sections = figures_of_2015(fast=arguments.fast)
    nls.figures.write_figures(out, {name: section.figure for name, section in sections.items()})
    lead = TextSection(
        "What is shown",
        "The figures of Austin, Schepelmann and Geyer (IROS 2015) that this project computes. Marks and "
        "measured curves are points that were read off the published vector graphics. "
        "Other figures of that paper are not claimed.",
    )
    nls.write_report(
        out / "report.html", lead, *sections.values(), title="Figures of the published actuator, made again"
    )
    for file in (PAPER / "paper.md", PAPER / "paper.bib"):
        write_text(out / file.name, file.read_text(encoding="utf-8"))
    shown = pictures((PAPER / "paper.md").read_text(encoding="utf-8"))
    if arguments.write:
        for picture in shown:
            shutil.copy(out / picture, PAPER / picture)
    print(f"{len(sections)} figures and the paper, which shows {', '.join(shown)}: {out}")
    return 0


def figures_of_2015(*, fast: bool) -> dict[str, FigureSection]:
    """Return the claimed figures as the studies show them, by the name of their picture.

    Parameters
    ----------
    fast
        Fewer frequencies, as of the studies.
    """
    at_rest: list[Section] = [
        *static_sections(compare_with_figures(declared_actuator())),
        *(finding.section() for finding in findings()),
    ]
    by_title = {section.title: section for section in _figures(at_rest)}
    loops = loop_sections(felt_torque(fast=fast), followed_torque(fast=fast))
    # Fig. 8 stands in both studies; that of the loops has no linear spring beside it.
    still = {name: by_title[title] for name, title in TITLES.items()}
    return {**still, **loops, "fig08": still["fig08"]}


def _figures(sections: Sequence[Section]) -> Iterator[FigureSection]:
    """Yield the figures, also those inside other sections."""
    for section in sections:
        if isinstance(section, FigureSection):
            yield section
        yield from _figures(getattr(section, "parts", ()))


def pictures(text: str) -> list[str]:
    """Return the files of the pictures that a text in Markdown shows.

    Parameters
    ----------
    text
        In Markdown.
    """
    return [picture["file"] for picture in _PICTURE.finditer(text)]


if __name__ == "__main__":
    sys.exit(main())
