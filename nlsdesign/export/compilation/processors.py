"""Processors of controllers: how the compiler and the emulator call them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Processor:
    """A processor of a controller.

    Parameters
    ----------
    name
        As in tables.
    target
        Target triple of the compiler; the last letters choose hard floating point.
    features
        Processor and floating-point unit as the compiler calls them.
    machine
        Board of the emulator with this processor.
    """

    name: str
    target: str
    features: str
    machine: str


CORTEX_M4F = Processor("Cortex-M4F", "thumb-freestanding-eabihf", "cortex_m4+vfp4d16sp", "mps2-an386")
"""Floating-point unit for float; double is computed by functions of the compiler."""

CORTEX_M7 = Processor("Cortex-M7", "thumb-freestanding-eabihf", "cortex_m7+fp_armv8d16", "mps2-an500")
"""Floating-point unit for float and double."""

PROCESSORS = (CORTEX_M4F, CORTEX_M7)
"""Those that tables and tests go through; the flash of an observer is measured on the first."""
