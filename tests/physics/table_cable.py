"""Two independent roads for each sensor, motor, gear, cam and cable."""

from __future__ import annotations

from nlsdesign.components import (
    CurrentSensor,
    DelayedForceSensor,
    DriftingForceSensor,
    Encoder,
    ForceSensor,
    SampleAndHold,
    SampledEncoder,
    Tachometer,
    TorqueSensor,
    TransportDelay,
)

from .table import Row

ROWS: tuple[Row, ...] = (
    Row(
        Encoder, "scatter of rounding q/√12", ("record of a wave", "uniform distribution"),
        "test_sensors.py::test_rounding_of_an_encoder_scatters_by_a_count_over_the_root_of_twelve",
    ),
    Row(
        SampledEncoder, "counts of a ramp", ("record", "integer arithmetic"),
        "test_sensors.py::test_counts_of_a_sampled_encoder_by_integer_arithmetic",
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
        DelayedForceSensor, "reading(t) = gain·F(t − τ) + bias",
        ("Padé states of the flat model", "exact shift in time"),
        "test_sensors.py::test_a_delay_in_the_flat_model_is_the_exact_delay_of_the_record",
    ),
    Row(
        DriftingForceSensor, "gain·F + bias + d·t", ("state of the flat model", "line of the record"),
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
)  # fmt: skip
