"""Independent roads of rubber."""

from __future__ import annotations

from nlsdesign import components as c
from tests.physics.table import Row

_ENERGY = "test_hyperelastic.py::test_work_put_in_is_the_energy_of_the_paper"
_ROADS = ("quadrature of the stress", "strain energy of the paper in the principal stretches")

ROWS: tuple[Row, ...] = (
    *(
        Row(law, "work = stored energy", _ROADS, _ENERGY)
        for law in (c.NeoHooke, c.Yeoh, c.Ogden, c.ExtendedTube)
    ),
    Row(
        c.FlowingChains,
        "work = stored energy + loss",
        ("simulated law", "elastic part from a quadrature of the flow equation written in the true stress"),
        "test_finite_viscoelasticity.py::test_work_is_stored_or_lost",
    ),
    Row(
        c.QuasilinearRelaxation,
        "relaxation",
        ("simulated law", "hereditary integral over the path of the strain, by quadrature"),
        "test_quasilinear.py::test_the_stress_is_the_hereditary_integral",
    ),
    Row(
        c.Springpot,
        "relaxation",
        ("simulated Prony series", "power law with the gamma function"),
        "test_networks.py::test_a_step_relaxes_by_a_power_law",
    ),
    Row(
        c.StressSoftening,
        "work lost in a cycle",
        ("simulated power", "closed form of Ogden and Roxburgh"),
        "test_history.py::test_what_is_lost_in_softening_is_work_minus_what_comes_back",
    ),
    Row(
        c.PermanentSet,
        "work = stored + lost",
        ("simulated power", "½E·ε² and the loss by hand"),
        "test_history.py::test_work_on_a_set_is_stored_or_lost_while_it_grows",
    ),
    Row(
        c.SelfHeating,
        "first law",
        ("simulated power", "heat, elastic energy and heat given off by hand"),
        "test_history.py::test_the_first_law_holds_at_every_moment",
    ),
    Row(
        c.WlfShift,
        "time-temperature superposition",
        ("law at its temperature", "law inside at the shifted frequency"),
        "test_temperature_shift.py::test_a_shifted_law_is_the_law_at_another_frequency",
    ),
    Row(
        c.ArrheniusShift,
        "activation energy",
        ("simulated relaxation at three temperatures", "slope of ln τ over 1/T"),
        "test_temperature_shift.py::test_arrhenius_by_its_slope",
    ),
)
