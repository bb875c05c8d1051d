"""The catalogue asks what a machine has already; rows and laws are found by being there."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from nlsdesign import components
from nlsdesign.bench.discrepancy import effects
from nlsdesign.bench.discrepancy.effects import ALL, catalogue
from nlsdesign.components import (
    ROTATION,
    TRANSLATION,
    Assembly,
    Backlash,
    CapstanFriction,
    ConstantLoad,
    CoulombFriction,
    Element,
    Fixed,
    GearedMotor,
    Guide,
    HeatBalance,
    Inertial,
    LargestMotion,
    LinearElastic,
    LoadFriction,
    LuGreFriction,
    Mass,
    NeoHooke,
    OgdenRoxburgh,
    PermanentSet,
    Pulley,
    QuadraticDrag,
    Rising,
    SelfHeating,
    Slack,
    SlidingFillers,
    Spring,
    StressSoftening,
    StretchyCable,
    StribeckFriction,
    Turned,
    ViscousHeat,
    WorkHeat,
    WrapProduct,
    assembly,
    parallel,
    pull_only,
    specimen,
    through,
    tie,
)
from nlsdesign.components.assembly import deck_reader
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.deck import read_deck
from nlsdesign.foundation.errors import UnknownNameError
from nlsdesign.model import flatten

GUM = NeoHooke(shear_modulus=0.4e6)
TWIST = Spring(stiffness=2.0, domain=ROTATION)
PULL = Spring(stiffness=2000.0)
WET = CoulombFriction(sliding_effort=0.02)


def drive(*, inside: Element | None = None, law: Element = GUM, **ties: Element) -> Assembly:
    """Motor, cam and rubber; a law in the rubber or something else behind the cam, more ties on the motor."""
    rubber = inside or specimen(area=1e-4, rest_length=0.0125, law=law)
    return assembly(
        "drive",
        motor=GearedMotor(inertia=1e-3, gear_ratio=4.0, torque_constant=0.05),
        load=Fixed(),
        spring=tie(through(Pulley(radius=0.01), rubber=rubber), "motor", "load"),
        **{name: tie(element, "motor") for name, element in ties.items()},
    )


def turned(wrapper: Element) -> Assembly:
    return assembly(
        "drive",
        motor=GearedMotor(inertia=1e-3, gear_ratio=4.0, torque_constant=0.05),
        spring=tie(wrapper, "motor"),
    )


def cart(friction: Element) -> Assembly:
    return assembly("cart", cart=Mass(mass=1.0), it=tie(friction, "cart"))


SPECIMEN = specimen(area=1e-4, rest_length=0.0125, law=GUM)
INSIDE = (("rubber", SPECIMEN),)
LAW = (("law", GUM),)
SPRING = (("spring", TWIST),)
STRIBECK = {"sliding_effort": 0.02, "breakaway": 0.01, "stribeck_speed": 0.5}
BRISTLES = {"stiffness": 120.0, "bristle_damping": 0.1, "damping": 1e-3}
HEAT = HeatBalance(heat_capacity=1.8e6, cooling=4e4, softening=3e-3)
DRY = ("coulomb_friction", "stribeck_friction")

HAVE: dict[str, tuple[Assembly, tuple[str, ...]]] = {
    "sticking": (drive(rub=WET), DRY[:1]),
    "creeping": (drive(rub=WET.smooth()), DRY[:1]),
    "Stribeck, sticking": (drive(rub=StribeckFriction(**STRIBECK)), DRY),
    "Stribeck, creeping": (drive(rub=StribeckFriction(**STRIBECK).smooth()), DRY),
    "LuGre": (drive(rub=LuGreFriction(**BRISTLES, **STRIBECK)), DRY),
    "friction beside a spring": (drive(rub=parallel(rub=WET.smooth(), spring=TWIST)), DRY[:1]),
    "sliding, sticking": (cart(CoulombFriction(sliding_effort=2.0, domain=TRANSLATION)), DRY[:1]),
    "sliding, LuGre": (cart(LuGreFriction(**BRISTLES, **STRIBECK, domain=TRANSLATION)), DRY[:1]),
    "constant force": (cart(ConstantLoad(load=1.0)), ("constant_force",)),
    "drag": (drive(fan=QuadraticDrag(drag=1e-3)), ("quadratic_drag",)),
    "load friction, sticking": (
        turned(LoadFriction(ratio=0.1, members=SPRING)),
        ("load_dependent_friction",),
    ),
    "load friction, creeping": (
        turned(LoadFriction(ratio=0.1, members=SPRING).smooth()),
        ("load_dependent_friction",),
    ),
    "backlash, sharp": (turned(Backlash(gap=0.01, members=SPRING)), ("backlash",)),
    "backlash, rounded": (turned(Backlash(gap=0.01, members=SPRING).smooth()), ("backlash",)),
    "backlash, inertial": (
        turned(Backlash(gap=0.01, members=SPRING, contact=Inertial(inertia=1e-4))),
        ("backlash",),
    ),
    "backlash inside": (
        turned(Turned(offset=0.1, members=(("backlash", Backlash(gap=0.01, members=SPRING)),))),
        ("backlash",),
    ),
    "slack, sharp": (drive(inside=Slack(length=1e-3, members=INSIDE)), ("cable_slack",)),
    "slack, rounded": (drive(inside=Slack(length=1e-3, members=INSIDE).smooth()), ("cable_slack",)),
    "guide": (
        drive(inside=CapstanFriction(members=INSIDE, guide=Guide(friction=0.1, wrap_angle=1.0))),
        ("cable_friction",),
    ),
    "product": (
        drive(inside=CapstanFriction(members=INSIDE, guide=WrapProduct(wrap=0.1))),
        ("cable_friction",),
    ),
    "guide inside": (
        drive(inside=pull_only(c=CapstanFriction(members=INSIDE, guide=WrapProduct(wrap=0.1)))),
        ("cable_friction",),
    ),
    "stretchy cable": (
        drive(
            inside=StretchyCable(
                stiffness=1e5, members=(("rubber", specimen(area=1e-4, rest_length=0.1, law=GUM)),)
            )
        ),
        ("cable_compliance",),
    ),
    "turned": (
        turned(Turned(offset=0.1, members=(("cam", through(Pulley(radius=0.01), rubber=SPECIMEN)),))),
        ("cam_angle_offset",),
    ),
    "softening by energy": (
        drive(law=StressSoftening(members=LAW, curve=OgdenRoxburgh(strength=1.8, scale=1e5))),
        ("stress_softening",),
    ),
    "softening by motion": (
        drive(inside=StressSoftening(members=INSIDE, curve=LargestMotion(softening=0.2))),
        ("stress_softening",),
    ),
    "set of the law": (
        drive(law=PermanentSet(members=LAW, share=0.05, memory=Rising(width=1e-4))),
        ("permanent_set",),
    ),
    "set of the piece": (drive(inside=PermanentSet(members=INSIDE, share=0.05)), ("permanent_set",)),
    "heat balance": (drive(law=SelfHeating(members=LAW, heat=HEAT)), ("self_heating",)),
    "heat of work": (
        drive(inside=SelfHeating(members=INSIDE, heat=WorkHeat(halving_work=40.0, cooling_time=8.0))),
        ("self_heating",),
    ),
    "heat of loss": (
        drive(inside=SelfHeating(members=INSIDE, heat=ViscousHeat(halving_speed=0.3, cooling_time=8.0))),
        ("self_heating",),
    ),
    "fillers": (
        drive(law=parallel(gum=LinearElastic(modulus=1e6), f=SlidingFillers(modulus=5e5, yield_stress=4e4))),
        ("rate_independent_hysteresis",),
    ),
}


@pytest.mark.parametrize("name", HAVE)
def test_what_a_machine_has_is_not_offered_again_whatever_law_brought_it(name: str) -> None:
    machine, kept_away = HAVE[name]
    offered = {effect.__name__ for effect in ALL if effect(machine)}
    assert offered.isdisjoint(kept_away)


@pytest.mark.parametrize("name", ["sticking", "creeping", "friction beside a spring"])
def test_dry_friction_that_is_declared_may_turn_out_to_fall_with_speed(name: str) -> None:
    """As one law in the place of the other: the same part, with friction at rest besides."""
    machine, _ = HAVE[name]
    (candidate,) = (
        c for c in effects.stribeck_friction(machine) if any("breakaway" in u.name for u in c.unknowns)
    )
    assert candidate.assembly.name == machine.name


def test_without_the_law_each_of_them_is_offered() -> None:
    """The test above could not fail if an effect had no place to sit at all."""
    bare = [drive(inside=PULL), drive(), turned(TWIST), cart(components.Dashpot(damping=1.0))]
    bare.append(turned(through(Pulley(radius=0.01), rubber=SPECIMEN)))
    offered = {effect.__name__ for machine in bare for effect in ALL if effect(machine)}
    assert offered >= {name for _, names in HAVE.values() for name in names}


def test_an_assembly_tells_what_a_body_and_what_a_path_has() -> None:
    machine = drive(inside=Slack(length=1e-3, members=INSIDE), rub=parallel(rub=WET))
    assert machine.has("motor", "dry friction")
    assert not machine.has("load", "dry friction")
    assert machine.has("load", "slack")
    for path in ("spring", "spring.rubber", "spring.rubber.rubber", "spring.rubber.rubber.law"):
        assert machine.has(path, "slack"), path
    assert not machine.has("spring.cam", "slack")
    assert not machine.has("spring", "dry friction")
    with pytest.raises(UnknownNameError, match="sprung"):
        machine.has("sprung", "slack")


# --- tables ---------------------------------------------------------------------------------------


def test_the_order_of_the_catalogue_is_that_of_the_ranks() -> None:
    assert [effect.rank for effect in ALL] == sorted({effect.rank for effect in ALL})
    assert [effect.__name__ for effect in ALL[:3]] == [*DRY, "load_dependent_friction"]
    assert catalogue() == ALL
    for effect in ALL:
        assert getattr(effects, effect.__name__) is effect
    with pytest.raises(AttributeError, match="coulomb_friction"):
        effects.coulomb_frction  # noqa: B018


ROW = """
from nlsdesign.components import Dashpot, ROTATION, tie
from nlsdesign.bench.discrepancy.effects import Edit, Effect, Form, Unknown
from nlsdesign.bench.discrepancy.effects.places import turning_bodies


def _greased(assembly, body):
    made = assembly.with_part("grease", tie(Dashpot(damping=1e-3, domain=ROTATION), body))
    yield Edit(made, (Unknown("grease.damping", (1e-3,), 1e-6, 1.0),))


form = Form(turning_bodies, _greased, "torque as the speed", "Newton 1687")
grease = Effect("grease", "Viscous friction.", 15, (form,))
nothing = Effect("nothing", "Nothing at all.", 25, ())
"""

LAW_FILE = '''
from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from nlsdesign.components.core.domain import ROTATION, TRANSLATION, Domain
from nlsdesign.components.core.part_numbers import one_of, parameter
from nlsdesign.components.core.springs import Elastic


@dataclass(frozen=True, kw_only=True)
class CubicSpring(Elastic):
    """F = k*e^3. Source: geometry."""

    domain: Domain = one_of(TRANSLATION, ROTATION)
    stiffness: object = parameter("{effort}/{motion}^3", "cubic stiffness")

    def effort(self, scope, motion, rate):
        return scope.parameter("stiffness") * motion**3
'''


@pytest.fixture
def written(tmp_path: Path) -> Iterator[Path]:
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


def test_an_effect_is_one_row_in_one_file(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (written / "lubrication.py").write_text(ROW, encoding="utf-8")
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(written)])
    named = [effect.__name__ for effect in catalogue()]
    assert named[:4] == ["coulomb_friction", "grease", "stribeck_friction", "nothing"]
    assert set(named) == {effect.__name__ for effect in ALL} | {"grease", "nothing"}
    (candidate,) = catalogue()[1](drive())
    assert (candidate.effect, candidate.location) == ("grease", "motor")
    assert flatten(candidate.assembly).values["grease.damping"] == 1e-3


def test_a_file_may_be_named_as_its_effect(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (written / "grease.py").write_text(ROW, encoding="utf-8")
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(written)])
    monkeypatch.setattr(effects, "grease", None, raising=False)  # nothing of it stays behind
    (row,) = [effect for effect in catalogue() if effect.__name__ == "grease"]
    assert effects.grease is row
    importlib.import_module(f"{effects.__name__}.grease")
    assert effects.grease is row
    (candidate,) = row(drive())
    assert candidate.effect == "grease"


def test_a_law_is_one_file(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (written / "cubic_spring.py").write_text(LAW_FILE, encoding="utf-8")
    room = importlib.import_module("nlsdesign.components.mechanics")
    monkeypatch.setattr(room, "__path__", [*room.__path__, str(written)])
    deck_reader._modules.cache_clear()
    try:
        text = (
            '[deck]\nname = "a"\n[wheel]\ncomponent = "Inertia"\n'
            'inertia = {value = 1.0, unit = "kg*m^2", source = "x"}\n[it]\ncomponent = "CubicSpring"\n'
            'between = ["wheel"]\nstiffness = {value = 2.0, unit = "N*m/rad^3", source = "x"}\n'
        )
        made = declare(read_deck(text, Path("a.toml")))
        assert type(made.element("it")) is components.CubicSpring
    finally:
        deck_reader._modules.cache_clear()
    assert made.element("it").domain == ROTATION
    assert flatten(made).evaluate([0.5, 0.0], [0.0])["it.torque"] == 2.0 * 0.5**3
