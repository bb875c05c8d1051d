"""Parts and assemblies: copies with other numbers or parts, immutability, what is refused.

Independent road: expected values are typed here; equality is that of frozen dataclasses.
"""

from __future__ import annotations

import dataclasses
import pickle

import numpy as np
import pytest

from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Area,
    Assembly,
    Dashpot,
    Driven,
    Encoder,
    Fixed,
    ForceSensor,
    Inertia,
    LinearElastic,
    Mass,
    Parallel,
    Pulley,
    Specimen,
    Spring,
    StrainStiffening,
    parallel,
    pull_only,
    series,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.components.core.part import find, quantities, replaced, with_values
from nlsdesign.foundation.errors import (
    ArrangementError,
    NlsError,
    UnitError,
    UnknownNameError,
    ValueRangeError,
)
from nlsdesign.foundation.quantity import Quantity, quantity
from nlsdesign.foundation.spread import RelativeSpread


def rubber() -> Specimen:
    return specimen(
        area=1e-4,
        rest_length=0.0125,
        stiff=StrainStiffening(modulus=(1e6, 2e6, 3e6), knots=(0.0, 0.1, 0.2)),
        relaxing=series(spring=LinearElastic(modulus=5e5), again=LinearElastic(modulus=6e5)),
    )


def machine() -> Assembly:
    return assembly(
        "machine",
        shaft=Inertia(inertia=1e-3),
        frame=Fixed(),
        spring=tie(through(Pulley(radius=0.01), rubber=rubber(), pretension=1e-3), "shaft", "frame"),
        cell=ForceSensor(of="spring.rubber.force"),
    )


# --- values ---------------------------------------------------------------------------------------


def test_copies_change_and_the_original_stays() -> None:
    first = machine()
    second = first.with_values(
        {"spring.rubber.area": 2e-4, "spring.rubber.stiff.modulus[2]": 7e6, "shaft.inertia": 5.0}
    )
    assert second.quantities()["spring.rubber.area"].number == 2e-4
    assert second.quantities()["spring.rubber.stiff.modulus"].values == (1e6, 7e6, 3e6)
    assert second.quantities()["shaft.inertia"].number == 5.0
    assert first == machine()
    assert second != first
    assert second.with_values({n: q for n, q in first.quantities().items()}) == first


def test_numbers_that_hang_together_change_together() -> None:
    """Ascending knots may be moved past each other's old places, in any order of writing."""
    for order in (1, -1):
        moved = {"spring.rubber.stiff.knots[2]": 0.5, "spring.rubber.stiff.knots[3]": 0.6}
        changed = machine().with_values(dict(list(moved.items())[::order]))
        assert changed.quantities()["spring.rubber.stiff.knots"].values == (0.0, 0.5, 0.6)
    longer = machine().with_values(
        {"spring.rubber.stiff.knots": (0.0, 0.3), "spring.rubber.stiff.modulus": np.array([1e6, 2e6])}
    )
    assert longer.quantities()["spring.rubber.stiff.modulus"].values == (1e6, 2e6)
    with pytest.raises(ValueRangeError, match="knots cross"):
        machine().with_values({"spring.rubber.stiff.knots[2]": 0.5})


def test_a_quantity_brings_its_unit_and_source_a_number_does_not() -> None:
    given = quantity(13.0, "mm", source="calliper", spread=0.01)
    changed = machine().with_values({"spring.rubber.rest_length": given})
    assert changed.quantities()["spring.rubber.rest_length"] == given
    plain = changed.with_values({"spring.rubber.rest_length": 0.014}).quantities()[
        "spring.rubber.rest_length"
    ]
    assert (plain.number, plain.unit, plain.spread) == (0.014, "mm", RelativeSpread(0.01))


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("spring.ruber.area", "spring.rubber.area"),
        ("spring.rubber.stiff.modulus[0]", "spring.rubber.stiff.modulus[3]"),
        ("spring.rubber.stiff.modulus[4]", "spring.rubber.stiff.modulus[3]"),
        ("spring.rubber.stiff.modulus[x]", "spring.rubber.stiff.modulus"),
        ("spring.rubber.area[1]", "spring.rubber.area"),
        ("shaft", None),
        ("", None),
    ],
)
def test_names_that_do_not_exist(name: str, near: str | None) -> None:
    with pytest.raises(UnknownNameError) as caught:
        machine().with_values({name: 1.0})
    assert name in str(caught.value)
    if near:
        assert caught.value.did_you_mean == near


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ({"spring.rubber.area": -1.0}, ValueRangeError),
        ({"spring.rubber.area": float("nan")}, ValueRangeError),
        ({"spring.rubber.area": (1e-4, 2e-4)}, ValueRangeError),
        ({"spring.rubber.area": quantity(1.0, "mm")}, UnitError),
        ({"spring.rubber.stiff.modulus[1]": quantity(1.0, "s")}, UnitError),
        ({"spring.rubber.stiff.modulus[1]": -1.0}, ValueRangeError),
    ],
)
def test_numbers_that_cannot_be(values: dict[str, float | Quantity], kind: type[NlsError]) -> None:
    with pytest.raises(kind):
        machine().with_values(values)


@pytest.mark.parametrize(
    ("kind", "fields", "meant"),
    [
        (Spring, {"stiffness": quantity(1e-8, "N/m")}, "kN/m"),
        (Pulley, {"radius": quantity(12.0, "m")}, "mm"),
        (Mass, {"mass": quantity(-1.0, "kg")}, None),
        (Encoder, {"of": "x", "quantum": quantity(44.0, "rad")}, "deg"),
        (Encoder, {"of": "x", "quantum": quantity(440.0, "rad")}, "mrad"),
    ],
)
def test_a_slip_of_units_is_recognised_only_where_it_fits(
    kind: type, fields: dict[str, object], meant: str | None
) -> None:
    """The unit that is offered is really in range: checked by making the part with it."""
    with pytest.raises(ValueRangeError) as caught:
        kind(**fields)
    if meant is None:
        assert caught.value.next_step is None
        return
    name = next(n for n in fields if n != "of")
    number = fields[name].shown  # type: ignore[attr-defined]
    offered = (caught.value.next_step or "").split("'")[1]
    assert offered == meant
    kind(**{**fields, name: quantity(number, offered)})


def test_parts_cannot_be_changed_in_place() -> None:
    first = machine()
    with pytest.raises(dataclasses.FrozenInstanceError):
        first["spring.rubber"].section = Area(3.0)  # type: ignore[attr-defined]
    with pytest.raises(dataclasses.FrozenInstanceError):
        first.name = "other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        first.parts[0] = ("a", Fixed())  # type: ignore[index]


def test_assemblies_pickle_and_print() -> None:
    first = machine()
    assert pickle.loads(pickle.dumps(first)) == first
    drawn = str(first)
    for name in ("shaft", "spring", "rubber", "relaxing", "cell", "StrainStiffening"):
        assert name in drawn


# --- the tree -------------------------------------------------------------------------------------


def test_names_are_paths_in_written_order() -> None:
    assert list(machine().quantities()) == [
        "shaft.inertia",
        "spring.pretension",
        "spring.cam.elements",
        "spring.cam.radius",
        "spring.rubber.rest_length",
        "spring.rubber.area",
        "spring.rubber.stiff.modulus",
        "spring.rubber.stiff.knots",
        "spring.rubber.relaxing.spring.modulus",
        "spring.rubber.relaxing.again.modulus",
        "cell.gain",
        "cell.bias",
        "cell.noise",
    ]


def test_a_part_is_found_replaced_added_and_taken_away() -> None:
    first = machine()
    assert first["spring.rubber.relaxing.spring"] == LinearElastic(modulus=5e5)
    stiffer = first.with_part("spring.rubber.relaxing.spring", LinearElastic(modulus=9e5))
    assert stiffer.quantities()["spring.rubber.relaxing.spring.modulus"].number == 9e5
    assert stiffer.with_part("spring.rubber.relaxing.spring", LinearElastic(modulus=5e5)) == first
    more = first.with_part("spring.rubber.second", LinearElastic(modulus=1e5))
    assert isinstance(more["spring.rubber.second"], LinearElastic)
    kept = first.with_part("spring", Spring(stiffness=3.0, domain=ROTATION))
    assert kept["spring"].between == ("shaft", "frame")  # type: ignore[attr-defined]
    added = first.with_part("brake", tie(Spring(stiffness=1.0, domain=ROTATION), "shaft"))
    assert added.without_part("brake") == first
    assert first.element("spring.rubber") == rubber()


@pytest.mark.parametrize("path", ["sprin", "spring.ruber", "spring.rubber.relaxing.sprig"])
def test_paths_that_do_not_exist(path: str) -> None:
    for action in (
        lambda: machine()[path],
        lambda: find(rubber(), path),
        lambda: machine().with_part(f"{path}.inner", Spring(stiffness=1.0)),
        lambda: machine().without_part(path),
        lambda: replaced(rubber(), path, Spring(stiffness=1.0)),
    ):
        with pytest.raises(UnknownNameError):
            action()


def test_functions_on_a_bare_part_agree_with_the_assembly() -> None:
    assert quantities(rubber())["stiff.modulus"].values == (1e6, 2e6, 3e6)
    assert with_values(rubber(), {"area": 2e-4}) == dataclasses.replace(rubber(), section=Area(2e-4))


# --- what is refused ------------------------------------------------------------------------------

REFUSED = {
    "two members of one name": lambda: Parallel(
        members=(("a", Spring(stiffness=1)), ("a", Spring(stiffness=2)))
    ),
    "two parts of one name": lambda: Assembly("a", (("p", Driven(domain=TRANSLATION)), ("p", Mass(mass=1)))),
    "a name with a dot": lambda: parallel(**{"a.b": Spring(stiffness=1)}),
    "a name with a bracket": lambda: assembly("a", **{"p[1]": Driven(domain=TRANSLATION)}),
    "a member called like a number": lambda: Specimen(
        section=Area(1e-4), rest_length=0.1, members=(("area", LinearElastic(modulus=1e6)),)
    ),
    "a member called like a key of a deck": lambda: parallel(between=Spring(stiffness=1)),
    "a part called like the head of a deck": lambda: assembly("a", deck=Driven(domain=TRANSLATION)),
    "nothing in series": lambda: series(),
    "a body in series": lambda: series(a=Mass(mass=1)),
    "angle and extension in parallel": lambda: parallel(
        a=Spring(stiffness=1), b=Spring(stiffness=1, domain=ROTATION)
    ),
    "extension and angle in series": lambda: series(
        a=Spring(stiffness=1, domain=ROTATION), b=Spring(stiffness=1)
    ),
    "a spring of N/m in a specimen": lambda: specimen(area=1e-4, rest_length=0.1, a=Spring(stiffness=1)),
    "a material on a point": lambda: assembly(
        "a", p=Driven(domain=TRANSLATION), s=tie(LinearElastic(modulus=1e6), "p")
    ),
    "a torsion spring on a point": lambda: assembly(
        "a", p=Driven(domain=TRANSLATION), s=tie(Spring(stiffness=1, domain=ROTATION), "p")
    ),
    "an angle behind a cam": lambda: through(Pulley(radius=0.01), a=Spring(stiffness=1, domain=ROTATION)),
    "a body behind a cam": lambda: through(Pulley(radius=0.01), a=Mass(mass=1)),
    "a sensor behind a cam": lambda: through(Pulley(radius=0.01), a=Encoder(of="x", quantum=1)),
    "a spring for a cam": lambda: through(Spring(stiffness=1), a=Spring(stiffness=1)),
    "two elements behind a cam": lambda: through(
        Pulley(radius=0.01), a=Spring(stiffness=1), b=Spring(stiffness=1)
    ),
    "a stress that only pulls": lambda: pull_only(a=LinearElastic(modulus=1e6)),
    "a spring to nobody": lambda: tie(Spring(stiffness=1)),
    "a spring between three": lambda: tie(Spring(stiffness=1), "a", "b", "c"),
    "a body for an element": lambda: tie(Mass(mass=1), "a"),
    "a spring to a stranger": lambda: assembly(
        "a", p=Driven(domain=TRANSLATION), s=tie(Spring(stiffness=1), "q")
    ),
    "a spring from a body to itself": lambda: assembly(
        "a", p=Driven(domain=TRANSLATION), s=tie(Spring(stiffness=1), "p", "p")
    ),
    "a spring between two walls": lambda: assembly(
        "a", p=Fixed(), q=Fixed(), s=tie(Spring(stiffness=1, domain=ROTATION), "p", "q")
    ),
    "an element without a tie": lambda: assembly("a", p=Driven(domain=TRANSLATION), s=Dashpot(damping=1)),
    "no body": lambda: assembly("a"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_impossible_arrangements_are_refused(name: str) -> None:
    with pytest.raises((ArrangementError, UnknownNameError)) as caught:
        REFUSED[name]()
    assert caught.value.thing
    assert caught.value.rule


def test_a_shaft_is_driven_a_point_is_not() -> None:
    assert assembly("a", p=Driven(), s=tie(Spring(stiffness=1, domain=ROTATION), "p"))["p"] == Driven()
