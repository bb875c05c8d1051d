"""Design of cam, rubber and pretension for a target torque curve."""

from ..foundation.spread import Spread, UniformSpread
from .curves.beside import SpringChoice, choose_spring, curve_beside
from .curves.compliance import OddSpring as OddSpring
from .curves.compliance import OneSidedSpring, TwoBranchSpring
from .curves.motor_and_gear import MotorAndGear, MotorCycle, motor_and_gear, motor_cycle
from .curves.target import (
    ExponentialTorque,
    PolynomialTorque,
    PowerTorque,
    TabulatedStiffness,
    TabulatedTorque,
    Target,
    TorqueBand,
)
from .curves.target_files import read_target
from .curves.task import MixedTask, Task, read_task, walking_task
from .curves.task_curve import (
    LeastEnergy,
    LeastPeakPower,
    SpringLimits,
    TaskCurve,
    TaskGoal,
    TaskProblem,
    curve_for_task,
    scan_gear_ratio,
)
from .drawing.cam_drawing import fingerprint, write_drawings
from .drawing.cam_part import CamPart
from .drawing.machined_cam import (
    BoltCircle,
    ClampScrew,
    FerruleSeat,
    MachinedCam,
    MachinedOneSidedCam,
    MachinedTwoSidedCam,
)
from .drawing.making import carrying_note as carrying_note
from .drawing.making import process_of as process_of
from .drawing.rolling_cam import MachinedPair, MachinedRollerCam
from .jobs.job_file import DRAWS as DRAWS
from .jobs.job_file import DesignJob as DesignJob
from .jobs.job_file import TaskTarget, read_job
from .jobs.job_file import back_of as back_of
from .jobs.job_file import job_of as job_of
from .jobs.job_file import kinds as kinds
from .jobs.job_file import read_entries as read_entries
from .jobs.job_file import read_stock as read_stock
from .jobs.job_file import read_target_entry as read_target_entry
from .jobs.job_file import target_of_file as target_of_file
from .jobs.written_design import (
    DESIGN_FILES as DESIGN_FILES,
)
from .jobs.written_design import (
    design_summary as design_summary,
)
from .jobs.written_design import machined_cam as machined_cam
from .jobs.written_design import (
    write_design,
    write_part,
    write_sides,
)
from .optimisation.coil_limits import (
    GoodmanSafety,
    MaximumPressureAngle,
    MaximumSpringIndex,
    MaximumTravel,
    MinimumHollowRadius,
    MinimumSpringIndex,
    PressedContact,
    RoomBetweenPivots,
)
from .optimisation.defaults import DesignSettings, safe_limits
from .optimisation.goals import (
    BothStrokes,
    EnergyLost,
    Goal,
    InsensitiveStiffness,
    LeastMass,
    LeastRubber,
    LeastSize,
    SmoothContour,
    TorqueError,
)
from .optimisation.limits import (
    AnchorDistance,
    AreaRange,
    AtMost,
    Limit,
    MaximumCableTension,
    MaximumCamRadius,
    MaximumLastingStrain,
    MaximumStrain,
    MaximumStress,
    MaximumTorqueError,
    MinimumRadiusOfCurvature,
    NumberRange,
    OneNumber,
    OverTravel,
    PositiveStiffness,
    PretensionRange,
    RestLengthRange,
    TorqueWithin,
)
from .optimisation.pareto import ParetoFront, pareto
from .optimisation.result import CamDesign, LimitState
from .optimisation.solve import GOALS as GOALS
from .optimisation.solve import design_cam, design_sides
from .optimisation.stock import CoilStock, RubberStock, Stock
from .optimisation.tolerance_goal import ToleranceQuantile, TrimRoom
from .statics.contour import Contour, contour_from_lever_arm
from .statics.declared_cam import contour_of_cam
from .statics.equilibrium import elastic_law as elastic_law
from .statics.equilibrium import equilibrium_torque
from .tolerance.causes import Cause, SpreadRules
from .tolerance.monte_carlo import tolerance_analysis
from .tolerance.tolerance_result import ToleranceResult
from .tolerance.trimming import Trim

__all__ = [
    "AnchorDistance",
    "AreaRange",
    "AtMost",
    "BoltCircle",
    "BothStrokes",
    "CamDesign",
    "CamPart",
    "Cause",
    "ClampScrew",
    "CoilStock",
    "Contour",
    "DesignSettings",
    "EnergyLost",
    "ExponentialTorque",
    "FerruleSeat",
    "Goal",
    "GoodmanSafety",
    "InsensitiveStiffness",
    "LeastEnergy",
    "LeastMass",
    "LeastPeakPower",
    "LeastRubber",
    "LeastSize",
    "Limit",
    "LimitState",
    "MachinedCam",
    "MachinedOneSidedCam",
    "MachinedPair",
    "MachinedRollerCam",
    "MachinedTwoSidedCam",
    "MaximumCableTension",
    "MaximumCamRadius",
    "MaximumLastingStrain",
    "MaximumPressureAngle",
    "MaximumSpringIndex",
    "MaximumStrain",
    "MaximumStress",
    "MaximumTorqueError",
    "MaximumTravel",
    "MinimumHollowRadius",
    "MinimumRadiusOfCurvature",
    "MinimumSpringIndex",
    "MixedTask",
    "MotorAndGear",
    "MotorCycle",
    "NumberRange",
    "OneNumber",
    "OneSidedSpring",
    "OverTravel",
    "ParetoFront",
    "PolynomialTorque",
    "PositiveStiffness",
    "PowerTorque",
    "PressedContact",
    "PretensionRange",
    "RestLengthRange",
    "RoomBetweenPivots",
    "RubberStock",
    "SmoothContour",
    "Spread",
    "SpreadRules",
    "SpringChoice",
    "SpringLimits",
    "Stock",
    "TabulatedStiffness",
    "TabulatedTorque",
    "Target",
    "Task",
    "TaskCurve",
    "TaskGoal",
    "TaskProblem",
    "TaskTarget",
    "ToleranceQuantile",
    "ToleranceResult",
    "TorqueBand",
    "TorqueError",
    "TorqueWithin",
    "Trim",
    "TrimRoom",
    "TwoBranchSpring",
    "UniformSpread",
    "choose_spring",
    "contour_from_lever_arm",
    "contour_of_cam",
    "curve_beside",
    "curve_for_task",
    "design_cam",
    "design_sides",
    "equilibrium_torque",
    "fingerprint",
    "motor_and_gear",
    "motor_cycle",
    "pareto",
    "read_job",
    "read_target",
    "read_task",
    "safe_limits",
    "scan_gear_ratio",
    "tolerance_analysis",
    "walking_task",
    "write_design",
    "write_drawings",
    "write_part",
    "write_sides",
]
