"""Independent roads of rubber that remembers and of a cable that rubs."""

from __future__ import annotations

from nlsdesign import components as c
from tests.physics.table import Row

_HERE = "test_ageing.py::test_"

ROWS: tuple[Row, ...] = (
    Row(
        c.StressSoftening,
        "work lost in a loop",
        ("simulated loop", "s·k·X²/6 in closed form"),
        _HERE + "a_softened_spring_loses_the_work_of_its_first_loop_only",
    ),
    Row(
        c.PermanentSet,
        "geometry",
        ("simulated force", "spring of a longer rest length"),
        _HERE + "a_spring_that_has_set_is_a_longer_spring",
    ),
    Row(
        c.SelfHeating,
        "first law",
        ("simulated heat", "quadrature of the work over an exponential"),
        _HERE + "heat_is_the_work_done_less_what_cooled_off",
    ),
    Row(
        c.SelfHeating,
        "first law",
        ("simulated heat", "quadrature of the loss over an exponential"),
        _HERE + "viscous_heat_is_the_loss_less_what_cooled_off",
    ),
    Row(
        c.SelfHeating,
        "first law",
        ("simulated heat", "quadrature of the dashpot's loss over an exponential"),
        _HERE + "heat_of_the_loss_inside_softens_what_does_not_relax",
    ),
    Row(
        c.StressSoftening,
        "definition",
        ("simulated force", "damage at the largest motion by hand"),
        _HERE + "damage_is_the_same_at_every_later_motion",
    ),
    Row(
        c.BoucWen,
        "work lost in a loop",
        ("simulated loop", "that of a spring with a dry slider, for a large exponent"),
        _HERE + "a_smooth_slider_with_a_large_exponent_is_a_dry_one",
    ),
    Row(
        c.HardeningSpring,
        "Taylor series",
        ("force", "c·x³ for small motion, and the derivative of its energy"),
        _HERE + "a_hardening_spring_is_a_cubic_at_first",
    ),
    Row(
        c.SoftWindup,
        "work",
        ("force beside a spring", "the integral of the stiffness over the motion, by quadrature"),
        _HERE + "a_soft_windup_lacks_its_stiffness_around_rest_alone",
    ),
    Row(
        c.CapstanFriction,
        "capstan",
        ("force", "Euler's differential equation along the wrap, integrated"),
        _HERE + "a_guide_is_eulers_equation",
    ),
)
