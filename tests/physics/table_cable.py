"""Two independent roads for each sensor, motor, gear, cam and cable."""

from __future__ import annotations

from nlsdesign.components import (
    AnchoredCam,
    CapstanFriction,
    CurrentDrivenMotor,
    CurrentSensor,
    Drift,
    Encoder,
    ForceSensor,
    Gear,
    LossyGear,
    OneSidedCam,
    RollerCam,
    RollingPair,
    SampleAndHold,
    Tachometer,
    TorqueSensor,
    TransportDelay,
    VoltageDrivenMotor,
)

from .table import Row

ROWS: tuple[Row, ...] = (
    Row(
        Encoder, "scatter of rounding q/√12", ("record of a wave", "uniform distribution"),
        "test_sensors.py::test_rounding_of_an_encoder_scatters_by_a_count_over_the_root_of_twelve",
    ),
    Row(
        Tachometer, "jω·ω_c/(jω + ω_c)", ("flat model and record of a wave", "transfer function"),
        "test_sensors.py::test_a_tachometer_is_a_differentiator_with_a_first_order_roll_off",
    ),
    Row(
        SampleAndHold, "zero-order hold sinc(fT)·e^(−iπfT)", ("record of a wave", "transfer function"),
        "test_sensors.py::test_a_held_signal_is_half_a_sample_late_and_smaller_by_sinc",
    ),
    Row(
        TransportDelay, "reading(t) = value(t − τ)", ("Padé states of the flat model", "exact shift in time"),
        "test_sensors.py::test_a_delay_in_the_flat_model_is_the_exact_delay_of_the_record",
    ),
    Row(
        Drift, "F + d·t", ("state of the flat model", "line of the record"),
        "test_sensors.py::test_a_drift_is_the_same_line_in_the_flat_model_and_in_the_record",
    ),
    Row(
        ForceSensor, "mean, spread and whiteness of the noise", ("record at rest", "statistics"),
        "test_sensors.py::test_noise_is_white_of_the_stated_size_and_led_by_the_seed",
    ),
    Row(
        TorqueSensor, "gain·T + bias", ("record", "arithmetic"),
        "test_sensors.py::test_transducer_and_ammeter_are_lines_in_a_record",
    ),
    Row(
        CurrentSensor, "I + bias", ("record", "arithmetic"),
        "test_sensors.py::test_transducer_and_ammeter_are_lines_in_a_record",
    ),
    Row(
        CurrentDrivenMotor, "torque over speed under current and voltage limit",
        ("flat model", "line through stall and no-load"),
        "test_motor_and_gear.py::"
        "test_torque_over_speed_is_the_line_from_stall_to_no_load_under_the_current_limit",
    ),
    Row(
        VoltageDrivenMotor, "power: electrical = mechanical + heat + ½L·I²",
        ("simulated power at the terminals", "powers integrated by Simpson's rule"),
        "test_motor_and_gear.py::test_electrical_power_is_mechanical_power_heat_and_field",
    ),
    Row(
        VoltageDrivenMotor, "poles", ("linearised flat model", "J·L·s² + J·R·s + k² = 0"),
        "test_motor_and_gear.py::test_the_poles_of_the_motor_are_the_roots_of_its_polynomial",
    ),
    Row(
        Gear, "θ₁ = n·θ₂ and J = n²·J₁ + J₂", ("two bodies and a gear", "one reflected body"),
        "test_motor_and_gear.py::test_rigidly_geared_inertias_are_one_state_pair_and_the_reflected_motor",
    ),
    Row(
        Gear, "rigid limit", ("gear of n = 1", "very stiff shaft between two state pairs"),
        "test_motor_and_gear.py::test_a_rigid_gear_is_the_limit_of_a_stiff_shaft",
    ),
    Row(
        LossyGear, "T₂ = n·T₁·s",
        ("piecewise linear root of the flat model", "trying both directions of power"),
        "test_motor_and_gear.py::test_a_lossy_gear_between_two_inertias_against_trying_both_directions",
    ),
    Row(
        LossyGear, "power: in = stored + lost, loss ≥ 0",
        ("simulation", "another integrator, Simpson's rule"),
        "test_motor_and_gear.py::"
        "test_a_swing_through_a_lossy_gear_against_another_integrator_and_its_power_balance",
    ),
    Row(
        OneSidedCam, "δ = ∫H, h = dδ/dθ", ("flat model", "scipy spline, numerical integration"),
        "test_cam_shapes.py::test_a_one_sided_cam_against_a_spline_integrated_numerically",
    ),
    Row(
        OneSidedCam, "work = energy of spring and cable", ("simulated torque", "energies by hand"),
        "test_cam_shapes.py::test_work_at_a_cam_is_the_energy_of_the_spring_and_of_the_cable",
    ),
    Row(
        AnchoredCam, "δ = P + √(D² − p²)", ("flat model", "taut string around a polygon"),
        "test_cam_shapes.py::test_an_anchored_cam_takes_up_a_string_laid_around_it",
    ),
    Row(
        AnchoredCam, "parallel cable as D → ∞", ("anchored cam", "two-sided cam, error like 1/D"),
        "test_cam_shapes.py::test_a_far_anchor_is_the_parallel_cable",
    ),
    Row(
        AnchoredCam, "ψ = −(θ + asin(h/D))", ("flat model", "contour drawn by the design room"),
        "test_cam_shapes.py::"
        "test_the_contour_that_the_design_draws_for_an_anchor_gives_back_its_lever_arm",
    ),
    Row(
        RollerCam, "N·F·dx/dθ = moment of the force at the contact",
        ("law", "balance of the follower and the cam at their point of contact"),
        "test_roller_cam.py::test_the_torque_balances_the_follower_at_its_point_of_contact",
    ),
    Row(
        RollingPair, "N·F·dd/dθ = moment of the element about the contact",
        ("law", "pair rolled without slip by integrating the motion of one profile on the other"),
        "test_rolling_pair.py::test_a_profile_that_rolls_on_its_mirror_image_moves_its_pivot_as_the_law_says",
    ),
    Row(
        CapstanFriction, "loop area k·E²·sinh(µφ)", ("simulation", "closed form"),
        "test_cam_shapes.py::test_the_loop_of_a_capstan_has_the_area_of_eytelwein",
    ),
    Row(
        CapstanFriction, "power lost ≥ 0", ("random path, cable that goes slack", "zero"),
        "test_cam_shapes.py::test_a_capstan_only_takes_power",
    ),
)  # fmt: skip
