"""Independent roads of faulty motors, encoders and cams."""

from __future__ import annotations

from nlsdesign import components as c
from tests.physics.table import Row

_HERE = "test_faults.py::test_"

ROWS: tuple[Row, ...] = (
    Row(
        c.DriveDelay,
        "delay",
        ("linearised motor", "e^(−iωτ)"),
        _HERE + "a_delayed_motor_has_the_phase_of_its_delay",
    ),
    Row(
        c.DriveSaturation,
        "Newton",
        ("flat model", "n·k_T·sin(arctan(I/I_s))·I_s by hand"),
        _HERE + "a_saturating_motor_follows_its_curve",
    ),
    Row(
        c.Eccentricity,
        "geometry",
        ("reading", "line of sight to a disc off its shaft"),
        _HERE + "an_eccentric_disc_reads_what_geometry_says",
    ),
    Row(
        c.CamWithProfileError,
        "virtual work",
        ("extension", "quadrature of scipy's B-spline of the lever arm"),
        _HERE + "extension_of_a_misshapen_cam_is_the_integral_of_its_lever_arm",
    ),
)
