"""Independent roads of springs, dampers, combinations, bodies, cams and sensors."""

from __future__ import annotations

from nlsdesign import components as c
from tests.physics.table import Row

_RUBBER, _BACKLASH = "test_rubber_laws.py::test_", "test_backlash_and_friction.py::test_"
_POWER, _SENSOR = "test_power_balance.py::test_", "../unit/components/test_sensors.py::test_"

ROWS: tuple[Row, ...] = (
    Row(
        c.Spring,
        "work = stored + lost",
        ("simulated power", "½k·e² by hand"),
        _POWER + "random_networks_with_hardening_springs_balance",
    ),
    Row(
        c.Dashpot,
        "complex stiffness",
        ("linearised network", "rule of springs and dashpots"),
        "test_random_networks.py::test_network_agrees_with_complex_stiffness",
    ),
    Row(
        c.Parallel,
        "complex stiffness",
        ("linearised network", "stiffnesses add"),
        "test_random_networks.py::test_network_agrees_with_complex_stiffness",
    ),
    Row(
        c.Series,
        "complex stiffness",
        ("linearised network", "compliances add"),
        "test_random_networks.py::test_network_agrees_with_complex_stiffness",
    ),
    Row(c.Spring, "Newton", ("flat model", "J·ω̇ by hand"), _RUBBER + "motor_against_newton"),
    Row(c.Dashpot, "Newton", ("flat model", "J·ω̇ by hand"), _RUBBER + "motor_against_newton"),
    Row(
        c.GearedMotor,
        "Newton",
        ("flat model", "n·k_T·I within the limit, by hand"),
        _RUBBER + "motor_against_newton",
    ),
    Row(c.Fixed, "action = reaction", ("signal of the bench", "−k·θ"), _RUBBER + "motor_against_newton"),
    Row(
        c.LinearElastic,
        "relaxation to equilibrium",
        ("simulation", "exponential of Tschoegl"),
        _RUBBER + "standard_linear_solid_relaxes_to_its_equilibrium",
    ),
    Row(
        c.ViscousMaterial,
        "Maxwell relaxation",
        ("simulation", "e^(−t·k/η)"),
        _RUBBER + "maxwell_relaxes_exponentially_with_viscosity_over_modulus",
    ),
    Row(
        c.StrainStiffening,
        "superposition",
        ("law", "sum of engaged springs"),
        _RUBBER + "strain_stiffening_is_the_sum_of_engaged_springs",
    ),
    Row(
        c.StrainStiffening,
        "limit of small width",
        ("smooth law", "sharp law"),
        _RUBBER + "smooth_law_tends_to_the_sharp_one",
    ),
    Row(
        c.CoulombFriction,
        "dissipation",
        ("law", "tanh by hand, T·ω ≥ 0"),
        _RUBBER + "dry_friction_saturates_and_always_takes_power",
    ),
    Row(
        c.PullOnly,
        "unilateral contact",
        ("smooth law", "max(F, 0) within w·ln 2"),
        _RUBBER + "a_cable_only_pulls",
    ),
    Row(
        c.Buckling,
        "a rod, and a band that only pulls",
        ("smooth law", "k·e, and max(k·e, 0) within w·ln 2"),
        _RUBBER + "a_piece_that_buckles_pushes_as_a_rod_does_but_for_a_share",
    ),
    Row(
        c.Tie,
        "action = reaction",
        ("two driven shafts", "difference of motions by hand"),
        _RUBBER + "an_element_between_two_moving_bodies_feels_the_difference",
    ),
    Row(
        c.Driven,
        "action = reaction",
        ("two driven shafts", "difference of motions by hand"),
        _RUBBER + "an_element_between_two_moving_bodies_feels_the_difference",
    ),
    Row(
        c.Specimen,
        "nominal stress",
        ("flat model", "A₀·σ(e/L₀) by hand"),
        "test_cam_equilibrium.py::test_strain_and_stress_are_nominal",
    ),
    Row(
        c.Driven,
        "work = stored + lost",
        ("simulated power of the grip", "energies by hand"),
        _POWER + "random_networks_with_hardening_springs_balance",
    ),
    Row(
        c.Through,
        "virtual work",
        ("torque", "energies by hand"),
        _POWER + "the_spring_alone_balances_when_it_is_driven",
    ),
    Row(
        c.TwoSidedCam,
        "integral",
        ("extension of the spline", "contour's lever arm, integrated"),
        "test_cam_geometry.py::test_extension_of_the_declared_cam_is_the_integral_of_its_contour_s_lever_arm",
    ),
    Row(
        c.Pulley,
        "passivity",
        ("∫T dθ", "never below zero"),
        _POWER + "no_path_wins_energy_from_a_cable_that_only_pulls",
    ),
    Row(
        c.Mass,
        "harmonic motion",
        ("simulation", "cos √(k/m)·t"),
        _BACKLASH + "a_mass_on_a_spring_swings_at_its_frequency",
    ),
    Row(
        c.Fixed,
        "action = reaction",
        ("signal of the wall", "−k·x"),
        _BACKLASH + "a_mass_on_a_spring_swings_at_its_frequency",
    ),
    Row(
        c.Inertia,
        "momentum and reduced inertia",
        ("simulation", "closed form"),
        _BACKLASH + "two_wheels_on_a_spring_keep_their_momentum_and_swing_at_the_reduced_inertia",
    ),
    Row(
        c.Backlash,
        "virtual work",
        ("torque", "slope of the stored energy"),
        _BACKLASH + "torque_behind_a_backlash_is_the_slope_of_its_energy",
    ),
    Row(
        c.Backlash,
        "momentum",
        ("simulation of an impact", "common speed of two wheels that stay together"),
        _BACKLASH + "what_meets_the_far_side_of_a_backlash_takes_it_along",
    ),
    Row(
        c.Slack,
        "rigid limit",
        ("smooth law", "max(e − s, 0)"),
        _BACKLASH + "slack_shifts_the_law_of_what_is_behind",
    ),
    Row(
        c.Turned,
        "change of zero",
        ("wrapped law", "law at the turned angle"),
        _BACKLASH + "a_turned_cam_is_the_cam_at_the_turned_angle",
    ),
    Row(
        c.StretchyCable,
        "series of springs, rigid limit",
        ("Newton root", "1/(1/C + 1/k)"),
        _BACKLASH + "a_stretchy_cable_is_a_spring_in_series",
    ),
    Row(
        c.InextensibleCable,
        "free recovery",
        ("simulation while slack", "closed-form recovery"),
        _BACKLASH + "a_slack_cable_meets_the_rubber_where_it_has_recovered_to",
    ),
    Row(
        c.StribeckFriction,
        "dissipation, published form",
        ("law", "Gaussian fall by hand"),
        _BACKLASH + "stribeck_lies_between_breakaway_and_sliding",
    ),
    Row(
        c.QuadraticDrag,
        "slowing down",
        ("simulation", "ω₀/(1 + c·ω₀·t/J)"),
        _BACKLASH + "drag_stops_a_wheel_as_one_over_one_plus_time",
    ),
    Row(
        c.TorqueRipple,
        "work over a turn",
        ("mean torque", "zero"),
        _BACKLASH + "ripple_does_no_work_over_a_turn",
    ),
    Row(
        c.GearFriction,
        "sum of efforts",
        ("acceleration of both bodies", "law by hand"),
        _BACKLASH + "friction_of_a_gear_acts_on_the_first_body_alone",
    ),
    Row(
        c.LoadFriction,
        "dissipation",
        ("law", "efficiency by hand"),
        _BACKLASH + "load_friction_takes_its_share_of_the_load_and_only_takes",
    ),
    Row(
        c.SlidingFillers,
        "independence of the rate",
        ("slow loop", "fast loop, area above zero"),
        _BACKLASH + "sliding_fillers_do_not_know_the_rate_and_only_lose",
    ),
    Row(
        c.Encoder,
        "rounding",
        ("reading", "half a count at most"),
        _SENSOR + "encoder_reads_whole_counts_half_a_count_off_at_most",
    ),
    Row(
        c.ForceSensor,
        "inverse",
        ("reading", "(reading − bias)/gain"),
        _SENSOR + "load_cell_and_ammeter_are_lines_and_their_inverse_is_exact",
    ),
    Row(
        c.CurrentSensor,
        "inverse",
        ("reading", "reading − bias"),
        _SENSOR + "load_cell_and_ammeter_are_lines_and_their_inverse_is_exact",
    ),
    Row(
        c.TransportDelay,
        "small-signal limit",
        ("linearised reading", "e^(−sτ)"),
        _SENSOR + "delay_against_the_exact_phase",
    ),
)
