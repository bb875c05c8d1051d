"""C code for the controller, FMUs for everybody else, and co-simulation of FMUs."""

from .c.controller_code import CSource, export_c
from .c.examples import write_examples
from .compilation.compiled_step import natively
from .compilation.cross_compiler import ALL_PLATFORMS, PLATFORMS, host_platform
from .compilation.running_c import CompiledStep
from .cosimulation.cosimulate import CoSimulation, cosimulate
from .cosimulation.master import Late
from .fmi.authorship import Authorship
from .fmi.fmu import export_fmu
from .fmi.reference_results import write_reference

__all__ = [
    "ALL_PLATFORMS",
    "PLATFORMS",
    "Authorship",
    "CSource",
    "CoSimulation",
    "CompiledStep",
    "Late",
    "cosimulate",
    "export_c",
    "export_fmu",
    "host_platform",
    "natively",
    "write_examples",
    "write_reference",
]
