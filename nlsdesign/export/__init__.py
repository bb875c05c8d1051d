"""C code for the controller, FMUs for everybody else, and co-simulation of FMUs."""

from .c_code import CSource, export_c
from .compile import ALL_PLATFORMS, PLATFORMS, host_platform
from .cosimulation import CoSimulation, cosimulate
from .cosimulation_system import Late
from .fmu import export_fmu
from .native import natively
from .running import CompiledStep

__all__ = [
    "ALL_PLATFORMS",
    "PLATFORMS",
    "CSource",
    "CoSimulation",
    "CompiledStep",
    "Late",
    "cosimulate",
    "export_c",
    "export_fmu",
    "host_platform",
    "natively",
]
