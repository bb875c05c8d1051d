"""``nlsdesign parts``: the components that a deck can name."""

from __future__ import annotations

import inspect
import math
from typing import TYPE_CHECKING

import click

from ..foundation.bibliography import cited
from ..foundation.errors import unknown_name
from ..foundation.quantity import typeset_unit
from .output import examples, json_option, show_json, show_table

if TYPE_CHECKING:
    from ..components import Part
    from ..components.core.part import ParameterInfo


@click.command(
    epilog=examples(
        "nlsdesign parts", "nlsdesign parts TwoSidedCam", "nlsdesign parts CoulombFriction --json"
    )
)
@click.argument("name", metavar="[PART]", required=False)
@json_option
def parts(name: str | None, as_json: bool) -> None:
    """List the parts that a deck can name, or show one: its law, source and numbers."""
    from ..components.assembly.deck_reader import component_classes
    from ..components.assembly.renamed import renamed

    known = component_classes()
    if name is None:
        rows = sorted((_kind(c), n, _law(c)) for n, c in known.items())
        if as_json:
            show_json({n: {"kind": kind, "law": law} for kind, n, law in rows})
        else:
            show_table("Parts", ("kind", "part", "law"), rows)
        return
    if name not in known:
        raise renamed(name) or unknown_name("part", name, known)
    infos, law = known[name].parameter_infos(), inspect.getdoc(known[name]) or ""
    publications = [str(reference) for reference in cited(law)]
    if as_json:
        content = {"law": law, "references": publications, "numbers": _plain(infos)}
        show_json({"kind": _kind(known[name]), **content})
        return
    click.echo("\n".join([f"{name} ({_kind(known[name])})", "", law, "", *publications, ""]))
    columns = ("name", "unit", "from", "to", "meaning")
    numbers = [
        (n, typeset_unit(i.unit), f"{i.minimum:g}", f"{i.maximum:g}", _meaning(i)) for n, i in infos.items()
    ]
    show_table("Numbers", columns, numbers)


def _kind(part: type[Part]) -> str:
    from ..components import Body, Cam, Element, Sensor, Transmission
    from ..components.mechanics.drive_chain import DrivePart

    kinds: dict[str, type[Part]] = {
        "element": Element, "body": Body, "gear": Transmission, "cam": Cam, "sensor": Sensor,
        "drive": DrivePart,
    }  # fmt: skip
    return next(kind for kind, base in kinds.items() if issubclass(part, base))


def _law(part: type[Part]) -> str:
    return (inspect.getdoc(part) or "").split("\n\n")[0].replace("\n", " ")


def _meaning(info: ParameterInfo) -> str:
    return info.description + (" (a row)" if info.row else "")


def _plain(infos: dict[str, ParameterInfo]) -> dict[str, dict[str, object]]:
    # JSON has no infinity.
    return {
        n: {
            "unit": i.unit,
            "minimum": i.minimum if math.isfinite(i.minimum) else None,
            "maximum": i.maximum if math.isfinite(i.maximum) else None,
            "meaning": i.description,
            "row": i.row,
        }
        for n, i in infos.items()
    }
