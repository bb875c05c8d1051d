"""Design of cam, rubber and pretension for a target torque curve."""

from .curves.target import ExponentialTorque, PowerTorque, TabulatedTorque, Target
from .drawing.cam_drawing import fingerprint, write_drawings
from .optimisation.cycle_goals import BothStrokes, EnergyLost
from .optimisation.defaults import safe_limits
from .optimisation.front import FrontPoint, ParetoFront
from .optimisation.goals import Goal, LeastRubber, SmoothContour, TorqueError
from .optimisation.limits import (
    AnchorDistance,
    AreaRange,
    Limit,
    MaximumCableTension,
    MaximumCamRadius,
    MaximumStrain,
    MaximumStress,
    MaximumTorqueError,
    MinimumRadiusOfCurvature,
    PositiveStiffness,
    PretensionRange,
    RestLengthRange,
)
from .optimisation.pareto import pareto
from .optimisation.result import CamDesign, LimitState, Sensitivity, TorqueCheck
from .optimisation.settings import DesignSettings
from .optimisation.size_goals import InsensitiveStiffness, LeastMass, LeastSize
from .optimisation.solve import design_cam, torque_check, torque_sensitivity
from .statics.contour import Contour, contour_from_curvature, contour_from_lever_arm
from .statics.declared_cam import CamFit, cam_from_profile, contour_of_cam
from .statics.energy import CamProfile, energy_profile
from .statics.equilibrium import ElasticLaw, elastic_law, equilibrium_torque

__all__ = [
    "AnchorDistance",
    "AreaRange",
    "BothStrokes",
    "CamDesign",
    "CamFit",
    "CamProfile",
    "Contour",
    "DesignSettings",
    "ElasticLaw",
    "EnergyLost",
    "ExponentialTorque",
    "FrontPoint",
    "Goal",
    "InsensitiveStiffness",
    "LeastMass",
    "LeastRubber",
    "LeastSize",
    "Limit",
    "LimitState",
    "MaximumCableTension",
    "MaximumCamRadius",
    "MaximumStrain",
    "MaximumStress",
    "MaximumTorqueError",
    "MinimumRadiusOfCurvature",
    "ParetoFront",
    "PositiveStiffness",
    "PowerTorque",
    "PretensionRange",
    "RestLengthRange",
    "Sensitivity",
    "SmoothContour",
    "TabulatedTorque",
    "Target",
    "TorqueCheck",
    "TorqueError",
    "cam_from_profile",
    "contour_from_curvature",
    "contour_from_lever_arm",
    "contour_of_cam",
    "design_cam",
    "elastic_law",
    "energy_profile",
    "equilibrium_torque",
    "fingerprint",
    "pareto",
    "safe_limits",
    "torque_check",
    "torque_sensitivity",
    "write_drawings",
]
