"""Design of cam, rubber and pretension for a target torque curve."""

from .curves.target import ExponentialTorque, PowerTorque, TabulatedTorque, Target
from .drawing.cam_drawing import fingerprint, write_drawings
from .optimisation.defaults import safe_limits
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
from .optimisation.result import CamDesign, LimitState, Sensitivity, TorqueCheck
from .optimisation.settings import DesignSettings
from .optimisation.solve import design_cam, torque_check, torque_sensitivity
from .statics.contour import Contour, contour_from_curvature, contour_from_lever_arm
from .statics.declared_cam import CamFit, cam_from_profile, contour_of_cam
from .statics.energy import CamProfile, energy_profile
from .statics.equilibrium import ElasticLaw, elastic_law, equilibrium_torque
from .tolerance.causes import Cause, NormalSpread, SpreadReading, UniformSpread, draw_deviations
from .tolerance.declared_spreads import MaterialScatter, OneBatch, SeparateModuli, SpreadRules
from .tolerance.monte_carlo import tolerance_analysis
from .tolerance.tolerance_result import CauseEffect, QuantileEstimate, ToleranceResult, TrimEffect
from .tolerance.trimming import Trim

__all__ = [
    "AnchorDistance",
    "AreaRange",
    "CamDesign",
    "CamFit",
    "CamProfile",
    "Cause",
    "CauseEffect",
    "Contour",
    "DesignSettings",
    "ElasticLaw",
    "ExponentialTorque",
    "Goal",
    "LeastRubber",
    "Limit",
    "LimitState",
    "MaterialScatter",
    "MaximumCableTension",
    "MaximumCamRadius",
    "MaximumStrain",
    "MaximumStress",
    "MaximumTorqueError",
    "MinimumRadiusOfCurvature",
    "NormalSpread",
    "OneBatch",
    "PositiveStiffness",
    "PowerTorque",
    "PretensionRange",
    "QuantileEstimate",
    "RestLengthRange",
    "Sensitivity",
    "SeparateModuli",
    "SmoothContour",
    "SpreadReading",
    "SpreadRules",
    "TabulatedTorque",
    "Target",
    "ToleranceResult",
    "TorqueCheck",
    "TorqueError",
    "Trim",
    "TrimEffect",
    "UniformSpread",
    "cam_from_profile",
    "contour_from_curvature",
    "contour_from_lever_arm",
    "contour_of_cam",
    "design_cam",
    "draw_deviations",
    "elastic_law",
    "energy_profile",
    "equilibrium_torque",
    "fingerprint",
    "safe_limits",
    "tolerance_analysis",
    "torque_check",
    "torque_sensitivity",
    "write_drawings",
]
