"""An effect for the diagnosis: wires through a joint, which the deck has forgotten."""

from __future__ import annotations

from collections.abc import Iterator

from nlsdesign import Assembly, quantity, tie
from nlsdesign.bench.discrepancy.effects import Edit, Effect, Form, Unknown
from nlsdesign.bench.discrepancy.effects.places import turning_bodies
from nlsdesign.bench.discrepancy.effects.sizes import efforts_on

from .laws import WireBundle


def _wires(assembly: Assembly, body: str) -> Iterator[Edit]:
    """Tie a bundle of wires to a body, with a stiffness and a hardening angle to be fitted."""
    law = WireBundle(
        stiffness=quantity(1.0, "N*m/rad", source="fitted to bench records"),
        hardening_angle=quantity(1.0, "rad", source="fitted to bench records"),
    )
    unknowns = (
        # Starts and bounds are counted in sizes of the records, so they fit small machines and large ones.
        Unknown("wires.stiffness", (0.1,), 1e-4, 10.0, f"{efforts_on(body)} / {body}.angle"),
        Unknown("wires.hardening_angle", (0.5, 2.0), 0.1, 20.0, f"{body}.angle", null=None),
    )
    yield Edit(assembly.with_part("wires", tie(law, body)), unknowns)


wire_bundle = Effect(
    "wire_bundle",
    "Wires that are bent by a joint.",
    76,  # before gravity_load: in a hand wires are more common than a horizontal axis
    (
        Form(
            turning_bodies,
            _wires,
            "torque that pulls back to one angle, the more the further, at any speed",
            "Example",
            brings="wires",
        ),
    ),
)
