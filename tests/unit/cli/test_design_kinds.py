"""``design --list``: each field says what it is, not only in which unit."""

from __future__ import annotations

import pytest

from nlsdesign.cli.design import KINDS, design_kinds


@pytest.mark.parametrize("what", KINDS)
def test_no_field_is_explained_by_its_unit_alone(what: str) -> None:
    fields = {
        f"{name}.{field}": str(about["meaning"])
        for name, kind in design_kinds(what).items()
        for field, about in kind["fields"].items()
    }
    assert len(fields) > 10
    bare = [
        name
        for name, meaning in fields.items()
        if meaning.startswith(("In ", "Of the ", "As for ", "Ends in")) or len(meaning.split()) < 3
    ]
    assert bare == []


def test_ranges_name_the_unit_of_what_they_hold() -> None:
    limits = design_kinds("limits")
    for name, unit in (("AreaRange", "m²"), ("AnchorDistance", "m"), ("MaximumCableTension", "N")):
        for about in limits[name]["fields"].values():
            assert about["meaning"].endswith(f"in {unit}.")
