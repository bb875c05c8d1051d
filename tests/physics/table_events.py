"""Two roads for each part that sticks, strikes, or has backlash."""

from __future__ import annotations

from nlsdesign.components import (
    Backlash,
    CoulombFriction,
    EndStop,
    LoadFriction,
    LuGreFriction,
    RigidStop,
    Slack,
    StribeckFriction,
)

from .table import Row

_DRY, _CONTACT, _LUGRE = "test_dry_friction.py::", "test_stops_and_contact.py::", "test_lugre.py::"

ROWS: tuple[Row, ...] = (
    Row(CoulombFriction, "4·T/k lost per cycle",
        ("simulation with located events", "half cosines around ±T/k"),
        _DRY + "test_a_swing_loses_four_times_the_torque_over_stiffness_per_cycle"),
    Row(StribeckFriction, "stick–slip on a belt",
        ("simulation with located events", "scipy phase by phase with its own events"),
        _DRY + "test_stick_slip_on_a_belt"),
    Row(LoadFriction, "power balance", ("work of the torque", "½Jω² + ½kθ² + ∫ µ·|T_in|·|ω|"),
        _DRY + "test_power_balance"),
    Row(LuGreFriction, "T = g(ω) + b·ω at steady speed", ("bristles in simulation", "Stribeck curve"),
        _LUGRE + "test_the_stribeck_curve_at_steady_speed"),
    Row(EndStop, "J·v·dv/(1 + d·v) = −k·p·dp", ("simulated rebound", "energy integral solved for the speed"),
        _CONTACT + "test_rebound_from_an_elastic_stop"),
    Row(EndStop, "corner as the width goes to zero", ("rounded stop", "located contact"),
        _CONTACT + "test_rounded_corners_tend_to_the_sharp_ones"),
    Row(RigidStop, "v⁺ = −e·v⁻", ("simulated impacts", "free fall between them"),
        _CONTACT + "test_a_bouncing_body_strikes_at_the_moments_of_free_fall"),
    Row(Backlash, "momentum and energy through the gap", ("simulation", "half sine of the reduced inertia"),
        _CONTACT + "test_backlash_between_two_inertias"),
    Row(Slack, "free flight, then half a sine", ("simulation", "closed form"),
        _CONTACT + "test_a_loose_cable_catches_a_mass"),
)  # fmt: skip
