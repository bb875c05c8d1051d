"""C code for the controller; FMUs, Modelica and MuJoCo models for everybody else; co-simulation of FMUs.

Presentation and commands may import it; it reads models, and designs nothing.
"""

from .c.asap2 import write_a2l as write_a2l
from .c.asap2 import write_watch_a2l
from .c.block_code import export_c_with_blocks as export_c_with_blocks
from .c.block_files import read_parameter_block as read_parameter_block
from .c.block_files import write_parameter_block as write_parameter_block
from .c.block_layout import ParameterBlock as ParameterBlock
from .c.coefficients import LoadableModel as LoadableModel
from .c.coefficients import loadable_model as loadable_model
from .c.controller_code import export_c
from .c.programs import write_examples as write_examples
from .c.programs import write_package as write_package
from .c.watch_code import WatchedBlock as WatchedBlock
from .c.watch_code import WatchPlan as WatchPlan
from .c.watch_code import export_watch as export_watch
from .c.watch_code import read_watch_record as read_watch_record
from .c.writer import CSource
from .compilation.compiled_step import natively, quickest
from .compilation.cross_compiler import ALL_PLATFORMS as ALL_PLATFORMS
from .compilation.processors import CORTEX_M4F, CORTEX_M7, PROCESSORS, Processor
from .compilation.proof import StepProof as StepProof
from .compilation.proof import prove_step
from .compilation.target_run import controller_sizes as controller_sizes
from .compilation.target_run import measure_on_target
from .cosimulation.cosimulate import Convergence, CoSimulation, convergence, cosimulate
from .cosimulation.cosimulate import FmuSystem as FmuSystem
from .cosimulation.coupling import Coupling as Coupling
from .cosimulation.coupling import Extrapolated, Held, Iterated, Stepping
from .cosimulation.run_plan import Late, SamplesOf, Wire
from .cosimulation.run_plan import as_wire as as_wire
from .cosimulation.ssp import read_ssp, write_ssp
from .exported_files import read_exports as read_exports
from .fmi.fmu import export_fmu
from .fmi.fmu_documentation import Authorship
from .fmi.reference_results import write_reference
from .modelica.modelica_model import export_modelica
from .mujoco.actuator_model import export_mujoco
from .mujoco.urdf_model import export_urdf

__all__ = [
    "CORTEX_M4F",
    "CORTEX_M7",
    "PROCESSORS",
    "Authorship",
    "CSource",
    "CoSimulation",
    "Convergence",
    "Extrapolated",
    "Held",
    "Iterated",
    "Late",
    "Processor",
    "SamplesOf",
    "Stepping",
    "Wire",
    "convergence",
    "cosimulate",
    "export_c",
    "export_fmu",
    "export_modelica",
    "export_mujoco",
    "export_urdf",
    "measure_on_target",
    "natively",
    "prove_step",
    "quickest",
    "read_ssp",
    "write_reference",
    "write_ssp",
    "write_watch_a2l",
]
