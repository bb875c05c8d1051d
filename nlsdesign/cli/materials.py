"""``nlsdesign materials``: rubbers of the library and their properties."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .output import examples, json_option, show_json, show_table

if TYPE_CHECKING:
    from ..components import Material


@click.command(
    epilog=examples("nlsdesign materials", "nlsdesign materials natural_rubber", "nlsdesign materials --json")
)
@click.argument("name", metavar="[MATERIAL]", required=False)
@json_option
def materials(name: str | None, as_json: bool) -> None:
    """List the rubbers of the library, or show one: values, conditions, grade of evidence and source."""
    from ..components.materials import library

    if name is None:
        known = library.materials()
        if as_json:
            show_json({m.name: {"family": m.family, "grade": m.grade} for m in known.values()})
            return
        rows = [(m.name, m.family, m.grade, _loss(m)) for m in known.values()]
        show_table("Materials", ("material", "family", "grade", "loss tangent"), rows)
        return
    chosen = library.material(name)
    columns = ("property", "value", *library.CONDITIONS, "evidence", "source")
    if as_json:
        rows_by_name = {row[0]: dict(zip(columns[1:], row[1:], strict=True)) for row in chosen.rows()}
        show_json({"family": chosen.family, "grade": chosen.grade, "properties": rows_by_name})
        return
    show_table(f"{chosen.name} ({chosen.family}): {chosen.grade}", columns, chosen.rows())
    if chosen.remark:
        click.echo(chosen.remark)


def _loss(material: Material) -> str:
    if "loss_tangent" not in material:
        return "not known"
    tangent = material["loss_tangent"]
    return f"{tangent.shown} ({tangent.evidence})"
