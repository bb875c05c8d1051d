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
        c.Springpot,
        "relaxation",
        ("simulated Prony series", "power law with the gamma function"),
        "test_networks.py::test_a_step_relaxes_by_a_power_law",
    ),
)
