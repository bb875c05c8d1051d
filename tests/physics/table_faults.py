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
        c.CommandSaturation,
        "Newton",
        ("flat model", "u_s·sin(arctan(u/u_s)) by hand"),
        _HERE + "what_falls_with_the_command_follows_its_curve",
    ),
    Row(
        c.GradualSaturation,
        "Newton",
        ("flat model", "integral of the gain 1/(1 + (u/u_s)²)"),
        _HERE + "what_falls_with_the_command_follows_its_curve",
    ),
    Row(
        c.CommandCompression,
        "Newton",
        ("flat model", "resistances in series by hand"),
        _HERE + "what_falls_with_the_command_follows_its_curve",
    ),
    Row(
        c.WindingHeat,
        "first law",
        ("simulated heat", "closed form of a body that warms under a steady loss"),
        _HERE + "a_winding_warms_as_a_body_with_one_time_constant",
    ),
    Row(
        c.TorqueConstantDrift,
        "definition",
        ("simulated torque", "line, and exponential approach"),
        _HERE + "a_torque_constant_drifts_along_its_curve",
    ),
    Row(
        c.LoadNonlinearity,
        "definition",
        ("reading and its inverse", "distance from the line through zero and full scale"),
        _HERE + "a_cell_is_off_most_in_the_middle_of_its_scale",
    ),
    Row(
        c.ClockDrift,
        "definition",
        ("flat model", "sine at the time of the other clock"),
        _HERE + "a_clock_that_loses_time_reads_an_earlier_value",
    ),
    Row(
        c.SpotFriction,
        "energy",
        ("work over a whole pass", "T_s·w·√π in closed form"),
        _HERE + "friction_of_a_place_takes_its_work",
    ),
    Row(
        c.WavyFriction,
        "energy",
        ("work over a whole turn", "2π·T_c in closed form"),
        _HERE + "friction_of_a_place_takes_its_work",
    ),
    Row(
        c.EncoderOffset,
        "definition",
        ("reading", "angle and offset"),
        _HERE + "an_encoder_whose_zero_is_off_reads_as_much_too_much_everywhere",
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
