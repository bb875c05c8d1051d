"""Two roads for each part that moves along a line."""

from __future__ import annotations

from nlsdesign.components import ConstantLoad, CoulombFriction, LinearDrive, Rack, Screw

from .table import Row

_BY_HAND = "test_models_by_hand.py::test_the_drive_agrees_with_its_equation_typed_here"
_BALANCE = "test_models_by_hand.py::test_work_put_into_the_drive_is_stored_or_lost"
_FINAL = "test_models_by_hand.py::test_the_drive_ends_at_the_speed_at_which_all_forces_cancel"

ROWS: tuple[Row, ...] = (
    Row(LinearDrive, "m·v̇ = g·V + ΣF",
        ("flattened assembly", "Radau on the equation typed again"), _BY_HAND),
    Row(CoulombFriction, "power balance", ("work of the voltage", "½mv² + ∫ of b·v² + F_c·v·tanh"), _BALANCE),
    Row(ConstantLoad, "b·v = g·V − F_c − F₀ at constant v",
        ("simulation for many time constants", "algebra"), _FINAL),
    Row(Rack, "x₂ = r·θ₁, m = m₂ + J₁/r²",
        ("motor, rack and carriage with a spring", "one reflected mass, Radau"),
        "test_racks_and_screws.py::test_a_carriage_moves_as_one_reflected_mass"),
    Row(Screw, "F₂ = (2π/l)·T₁, power in = power out",
        ("efforts of the flat model", "work of motor and spring, Simpson's rule"),
        "test_racks_and_screws.py::test_what_the_motor_gives_is_stored_or_lost"),
)  # fmt: skip
