"""C code for the controller, FMUs for everybody else, and co-simulation of FMUs."""

from .c.controller_code import export_c
from .c.programs import write_examples
from .c.writer import CSource
from .compilation.compiled_step import natively, quickest
from .compilation.cross_compiler import ALL_PLATFORMS
from .cosimulation.convergence import Convergence, convergence
from .cosimulation.cosimulate import CoSimulation, FmuSystem, cosimulate
from .cosimulation.coupling import Extrapolated, Held, Iterated, Stepping
from .cosimulation.wires import Late, SamplesOf, Wire
from .fmi.authorship import Authorship
from .fmi.fmu import export_fmu
from .fmi.reference_results import write_reference
from .modelica.modelica_model import export_modelica
from .ssp.read_ssp import read_ssp
from .ssp.write_ssp import WrittenSystem, write_ssp
from .target.processors import CORTEX_M4F, CORTEX_M7, Processor
from .target.target_run import TargetMeasurement, measure_on_target

__all__ = [
    "ALL_PLATFORMS",
    "CORTEX_M4F",
    "CORTEX_M7",
    "Authorship",
    "CSource",
    "CoSimulation",
    "Convergence",
    "Extrapolated",
    "FmuSystem",
    "Held",
    "Iterated",
    "Late",
    "Processor",
    "SamplesOf",
    "Stepping",
    "TargetMeasurement",
    "Wire",
    "WrittenSystem",
    "convergence",
    "cosimulate",
    "export_c",
    "export_fmu",
    "export_modelica",
    "measure_on_target",
    "natively",
    "quickest",
    "read_ssp",
    "write_examples",
    "write_reference",
    "write_ssp",
]
