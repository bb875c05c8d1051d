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
from .target.processors import CORTEX_M4F, CORTEX_M7, Processor
from .target.target_run import TargetMeasurement, TargetRun, measure_on_target

__all__ = [
    "ALL_PLATFORMS",
    "CORTEX_M4F",
    "CORTEX_M7",
    "PLATFORMS",
    "Authorship",
    "CSource",
    "CoSimulation",
    "CompiledStep",
    "Late",
    "Processor",
    "TargetMeasurement",
    "TargetRun",
    "cosimulate",
    "export_c",
    "export_fmu",
    "host_platform",
    "measure_on_target",
    "natively",
    "write_examples",
    "write_reference",
]
