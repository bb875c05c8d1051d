"""Circuits as text and as a picture: what is drawn in series and in parallel is what the model computes."""

from __future__ import annotations

import random
import re
import xml.etree.ElementTree as ET

import pytest

from nlsdesign.components import (
    TRANSLATION,
    Assembly,
    Dashpot,
    Driven,
    Element,
    Fixed,
    Mass,
    Spring,
    parallel,
    series,
    tie,
)
from nlsdesign.components.assembly.circuit import Circuit, Leaf, Row, circuit_lines, circuit_of, draw
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.components.assembly.named_parts import assembly
from nlsdesign.foundation.deck import deck_names, load_deck
from nlsdesign.model import flatten
from nlsdesign.model.flat import equations

SVG = "{http://www.w3.org/2000/svg}"


def spring(stiffness: float) -> Spring:
    return Spring(stiffness=stiffness)


def leaves(circuit: Circuit) -> list[Leaf]:
    return [circuit] if isinstance(circuit, Leaf) else [leaf for i in circuit.items for leaf in leaves(i)]


# --- text -----------------------------------------------------------------------------------------


def test_series_and_parallel_read_as_they_are() -> None:
    standard = parallel(stiff=spring(2.0), relaxing=series(spring=spring(1.0), dashpot=Dashpot(damping=3.0)))
    assert circuit_lines(circuit_of(standard, "net"), "grip", "clamp") == [
        "(grip)┬─╱╲╱╲ stiff ───────────────────────────────────┬─(clamp)",
        "      └─╱╲╱╲ relaxing.spring ───[│─ relaxing.dashpot ─┘",
    ]


def test_a_drawing_fits_its_width_and_loses_nothing() -> None:
    machine = declare(load_deck("test_rig"))
    whole, narrow = str(machine), draw(f"{machine.name}: {machine.description}", machine.parts, width=60)
    assert max(map(len, whole.splitlines())) > 120
    assert max(map(len, narrow.splitlines())) <= 60
    assert draw(f"{machine.name}: {machine.description}", machine.parts) == whole
    text = re.sub(r"[\s│├└─]", "", narrow).replace("…", "")
    pieces = re.sub(r"[\s│├└─]", "", whole)
    assert sorted(text) == sorted(pieces)
    assert narrow.splitlines()[7:16] == [
        *("    (motor)──◖─ cam ───◇─ cable ─┬─╱╲╱╲ stiff ──────────── …",),
        *("                                 └─╱╲╱╲ relaxing.spring ── …",),
        *("    … ───────────────────────┬─(load)", "    … ─[│─ relaxing.dashpot ─┘"),
        *("    ├─ cam: TwoSidedCam(elements = 1,", "    │      lever_arm = <80 numbers in m>,"),
        *("    │      last_angle = 0.977384 rad,", "    │      changeover = 2e-05 rad,"),
        "    │      anchor_distance = 1e+06 m)",
    ]


def test_circuits_inside_circuits_keep_their_wires() -> None:
    inner = parallel(c=spring(1.0), d=series(e=spring(1.0), f=parallel(g=spring(1.0), h=spring(1.0))))
    assert circuit_lines(circuit_of(series(a=spring(1.0), b=inner, z=spring(1.0)), "n"), "x", "y") == [
        "(x)─╱╲╱╲ n.a ─┬─╱╲╱╲ c ──────────────┬─╱╲╱╲ n.z ──(y)",
        "              └─╱╲╱╲ d.e ─┬─╱╲╱╲ g ─┬┘",
        "                          └─╱╲╱╲ h ─┘",
    ]


def joined(lines: list[str]) -> bool:
    """Whether each corner has its partner above or below."""
    width = max(map(len, lines))
    grid = [line.ljust(width) for line in lines]
    for number, line in enumerate(grid):
        for at, letter in enumerate(line):
            above = number > 0 and grid[number - 1][at] in "┬├┤│"
            below = number + 1 < len(grid) and grid[number + 1][at] in "└├┤│┘"
            if (letter in "└┘" and not above) or (letter == "┬" and not below):
                return False
            inside = letter == "│" and line[at - 1] != "["
            if (letter in "├┤" or inside) and not (above and below):
                return False
    return True


@pytest.mark.parametrize("name", deck_names())
def test_every_actuator_draws_its_circuit_with_all_elements(name: str) -> None:
    made = declare(load_deck(name))
    text = str(made)
    for part_name, part in made.parts:
        assert part_name in text
        if hasattr(part, "element") and part.children():
            circuit = circuit_of(part.element, part_name)
            lines = circuit_lines(circuit, "a", "b")
            assert joined(lines), lines
            drawn = "\n".join(lines)
            assert all(f" {leaf.label} " in drawn for leaf in leaves(circuit))
            assert len(leaves(circuit)) >= 2


def network(draw: random.Random, depth: int) -> Element:
    if depth == 0 or draw.random() < 0.3:
        return spring(draw.uniform(0.5, 5.0))
    members = {f"m{n}": network(draw, depth - 1) for n in range(draw.randint(2, 3))}
    return (parallel if draw.random() < 0.5 else series)(**members)


def drawn_stiffness(circuit: Circuit, values: list[float]) -> float:
    """Stiffness of what is drawn, by the rules for springs in series and in parallel."""
    if isinstance(circuit, Leaf):
        return values.pop(0)
    each = [drawn_stiffness(item, values) for item in circuit.items]
    return 1.0 / sum(1.0 / k for k in each) if isinstance(circuit, Row) else sum(each)


@pytest.mark.parametrize("seed", range(25))
def test_what_is_drawn_is_what_is_computed(seed: int) -> None:
    element = network(random.Random(seed), 3)
    made = assembly(
        "net",
        grip=Driven(domain=TRANSLATION),
        clamp=Fixed(domain=TRANSLATION),
        net=tie(element, "grip", "clamp"),
    )
    values = [q.number for name, q in made.quantities().items() if name.endswith("stiffness")]
    circuit = circuit_of(element, "net")
    assert joined(circuit_lines(circuit, "grip", "clamp"))
    force = flatten(made).evaluate([], [0.01, 0.0])["net.force"]
    assert force == pytest.approx(0.01 * drawn_stiffness(circuit, values), rel=1e-9)
    assert values == []


# --- notebooks ------------------------------------------------------------------------------------


def picture(html: str) -> ET.Element:
    return ET.fromstring(html[html.index("<svg") : html.index("</svg>") + 6])


@pytest.mark.parametrize("name", deck_names())
def test_notebooks_show_the_circuit_of_an_assembly(name: str) -> None:
    made = declare(load_deck(name))
    bundle = made._repr_mimebundle_()
    assert bundle["text/plain"] == str(made)
    svg = picture(bundle["text/html"])
    words = [each.text for each in svg.iter(f"{SVG}text")]
    for part_name, part in made.parts:
        if hasattr(part, "element"):
            for leaf in leaves(circuit_of(part.element, part_name)):
                assert leaf.label in words
            assert set(part.between) <= set(words)
    width, height = float(svg.get("width", 0)), float(svg.get("height", 0))
    for each in svg.iter(f"{SVG}text"):
        assert 0 <= float(each.get("x", -1)) <= width
        assert 0 <= float(each.get("y", -1)) <= height


def test_names_are_escaped() -> None:
    made = Assembly("a<b", (("mass", Mass(mass=1.0)), ("s", tie(spring(1.0), "mass"))), "x & y")
    html = made._repr_html_()
    assert "a&lt;b" in html
    assert "x &amp; y" in html
    picture(html)


def test_notebooks_show_block_and_equations_of_a_model() -> None:
    made = assembly("swing", mass=Mass(mass=2.0), spring=tie(spring(8.0), "mass"))
    model = flatten(made, outputs=["mass.position"])
    bundle = model._repr_mimebundle_()
    assert bundle["text/plain"] == str(model)
    view = model.symbolic_equations()
    assert bundle["text/latex"] == f"$${view.latex()}$$"
    words = [each.text for each in picture(bundle["text/html"]).iter(f"{SVG}text")]
    assert {"mass.force [N]", "mass.position [m]", "mass.speed [m/s]", "states"} <= set(words)
    assert r"\dot{\mathrm{mass.speed}}" in bundle["text/html"]


def test_the_method_and_the_function_give_the_same_equations() -> None:
    model = flatten(declare(load_deck("austin2015_as_printed")))
    one, other = model.symbolic_equations(), equations(model)
    assert (one.derivatives, one.definitions, one.discrete) == (
        other.derivatives,
        other.definitions,
        other.discrete,
    )
    assert str(one).startswith("der(motor.angle) = motor.speed")
    (speed,) = one.derivatives["motor.angle"].free_symbols
    assert speed.name == "motor.speed"
