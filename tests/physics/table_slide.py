"""Two roads for each part that moves along a line."""

from __future__ import annotations

from nlsdesign.components import ConstantLoad, CoulombFriction, LinearDrive

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
)  # fmt: skip
