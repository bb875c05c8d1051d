"""``nlsdesign docs``: where the documentation is, which is installed with the package."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click

from ..foundation.errors import unknown_name
from ..foundation.locations import folder
from .output import examples, json_option, show_json

_SITE = "site"
"""Folder of what the pages on the web are built from."""


@click.command(
    epilog=examples("nlsdesign docs", "nlsdesign docs design_a_cam", "nlsdesign docs conventions --print"),
)
@click.argument("page", required=False)
@click.option("--print", "whole", is_flag=True, help="Print the page.")
@json_option
def docs(page: str | None, whole: bool, as_json: bool) -> None:
    """Say where the documentation is, list its pages, or name the file of one PAGE.

    Pages are Markdown, which is read in any editor.
    """
    pages = dict(_pages(folder("docs")))
    if page is None:
        if whole:
            raise click.UsageError("--print needs a PAGE, for instance: nlsdesign docs conventions --print")
        if as_json:
            show_json(
                {"folder": folder("docs"), "pages": {name: title for name, (_, title) in pages.items()}}
            )
            return
        click.echo(f"{folder('docs')}\n")
        width = max(map(len, pages))
        for name, (_, title) in pages.items():
            click.echo(f"{name:<{width}}  {title}")
        return
    name = page.removesuffix(".md")
    matches = [each for each in pages if each == name or each.rpartition("/")[2] == name]
    if len(matches) != 1:
        raise unknown_name("page", page, pages)
    file, title = pages[matches[0]]
    if as_json:
        text = {"text": file.read_text(encoding="utf-8")} if whole else {}
        show_json({"page": matches[0], "title": title, "file": file, **text})
    else:
        click.echo(file.read_text(encoding="utf-8") if whole else str(file))


def _pages(place: Path) -> Iterator[tuple[str, tuple[Path, str]]]:
    """Yield name, file and title of each page, folder by folder; what a site is made of is no page."""
    files = sorted(place.rglob("*.md"), key=lambda each: (len(each.parts), each.parent, each.name))
    for file in files:
        if file.relative_to(place).parts[0] == _SITE:
            continue
        with file.open(encoding="utf-8") as stream:
            title = stream.readline().removeprefix("#").strip()
        yield file.relative_to(place).with_suffix("").as_posix(), (file, title)
