"""Run studies and keep some of their figures for the gallery: ``python -m docs.site.collect [STUDY …]``.

Studies take minutes, so their figures are committed, and ``docs/gallery/made.toml`` says when and with what
they were made. Kept are the first small figures of each report, with the colours as variables of the page.
"""

from __future__ import annotations

import argparse
import datetime
import json
import platform
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from html import unescape
from importlib.metadata import version as version_of
from pathlib import Path

from nlsdesign.cli.studies import study_names
from nlsdesign.foundation import locations
from nlsdesign.foundation.text_files import write_text

GALLERY = Path(__file__).resolve().parents[1] / "gallery"
_FIGURE = re.compile(r"<figure.*?(?P<svg><svg.*?</svg>)(?P<rest>.*?)</figure>", re.S)
_HEADING = re.compile(r"<h[2-4][^>]*>(.*?)</h[2-4]>", re.S)
_CAPTION = re.compile(r"<figcaption>(.*?)</figcaption>", re.S)
_LARGEST = 45_000
_MOST = 3
_FONTS = re.compile(r"font-family: [^;\"]+(;\s*|(?=\"))")


def main() -> int:
    """Run the studies that are named, or all; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m docs.site.collect", description=__doc__)
    parser.add_argument("study", nargs="*", help="all where none is named")
    parser.add_argument(
        "--reports", type=Path, help="folder with one folder for each study, instead of running them"
    )
    arguments = parser.parse_args()
    made = read_made()
    for name in arguments.study or study_names():
        with tempfile.TemporaryDirectory() as folder:
            out = arguments.reports / name if arguments.reports else Path(folder)
            if not arguments.reports:
                command = [
                    sys.executable,
                    "-m",
                    "nlsdesign",
                    "study",
                    "run",
                    name,
                    "--fast",
                    "--out",
                    str(out),
                ]
                subprocess.run(command, check=True)
            report = out / "report.html"
            text = report.read_text(encoding="utf-8") if report.is_file() else ""
            kept = list(figures_of(text, name))
        for number, (_, _, svg) in enumerate(kept, start=1):
            write_text(GALLERY / f"{name}-{number}.svg", svg + "\n")
        made[name] = {
            "command": f"nlsdesign study run {name} --fast",
            "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
            "with": (
                f"nlsdesign {locations.version()}, CasADi {version_of('casadi')}, "
                f"Python {platform.python_version()}"
            ),
            "titles": [title for title, _, _ in kept],
            "captions": [caption for _, caption, _ in kept],
        }
        print(f"{name}: {len(kept)} figures")
    write_text(GALLERY / "made.toml", _toml(made))
    return 0


def read_made() -> dict[str, dict[str, object]]:
    """Return what ``made.toml`` says of each study."""
    file = GALLERY / "made.toml"
    return tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}


def figures_of(report: str, name: str) -> Iterator[tuple[str, str, str]]:
    """Yield title, caption and SVG of the first small figures of a report.

    Parameters
    ----------
    report
        HTML.
    name
        Put before all identifiers, so that figures of several studies can stand on one page.
    """
    # One with classes is drawn by the style and the script of its report.
    small = [
        each
        for each in _FIGURE.finditer(report)
        if len(each["svg"]) <= _LARGEST and "class=" not in each["svg"]
    ]
    for each in small[:_MOST]:
        svg = re.sub(r'id="', f'id="{name}-', each["svg"])
        svg = re.sub(r'(href="|url\()#', rf"\1#{name}-", svg)
        title = _HEADING.findall(report[: each.start()])[-1:]
        caption = _CAPTION.findall(each["rest"])[:1]
        yield _plain("".join(title)), _plain("".join(caption).partition("<div")[0]), _FONTS.sub("", svg)


def _plain(html: str) -> str:
    return " ".join(unescape(re.sub(r"<[^>]+>", "", html)).split())


def _toml(made: dict[str, dict[str, object]]) -> str:
    head = "# Written by `make gallery`: when and with what the figures of the gallery were made.\n"
    tables = (
        f"\n[{name}]\n"
        + "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in entry.items())
        for name, entry in sorted(made.items())
    )
    return head + "".join(tables)


if __name__ == "__main__":
    sys.exit(main())
