"""C code for the controller, FMUs for everybody else, and co-simulation of FMUs."""

from .c.controller_code import CSource, export_c
from .compilation.compiled_step import natively
from .compilation.cross_compiler import ALL_PLATFORMS, PLATFORMS, host_platform
from .compilation.running_c import CompiledStep
from .cosimulation.convergence import Convergence, convergence
from .cosimulation.cosimulate import CoSimulation, FmuSystem, cosimulate
from .cosimulation.coupling import Extrapolated, Held, Iterated, Stepping
from .cosimulation.wires import Late, SamplesOf, Wire
from .fmi.fmu import export_fmu
from .ssp.read_ssp import read_ssp
from .ssp.write_ssp import WrittenSystem, write_ssp

__all__ = [
    "ALL_PLATFORMS",
    "PLATFORMS",
    "CSource",
    "CoSimulation",
    "CompiledStep",
    "Convergence",
    "Extrapolated",
    "FmuSystem",
    "Held",
    "Iterated",
    "Late",
    "SamplesOf",
    "Stepping",
    "Wire",
    "WrittenSystem",
    "convergence",
    "cosimulate",
    "export_c",
    "export_fmu",
    "host_platform",
    "natively",
    "read_ssp",
    "write_ssp",
]
