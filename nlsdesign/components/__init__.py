"""Parts that can be declared; they never learn what they are used for."""

from .assembly import Assembly, assembly
from .bodies import Body, Driven, DrivenPoint, Fixed, FixedPoint, GearedMotor, Inertia, Mass
from .cam import Cam, Pulley, TwoSidedCam, control_values
from .dampers import CoulombFriction, Dashpot, TorsionDashpot, ViscousMaterial
from .element import MATERIAL, ROTATION, TRANSLATION, Domain, Element, Parallel, Series, parallel, series
from .networks import PullOnly, Specimen, Through, pull_only, specimen, through
from .part import Part
from .sensors import CurrentSensor, DelayedForceSensor, Encoder, ForceSensor, Sensor
from .springs import LinearElastic, SmoothStrainStiffening, Spring, StrainStiffening, TorsionSpring
from .tie import Tie, tie

__all__ = [
    "MATERIAL",
    "ROTATION",
    "TRANSLATION",
    "Assembly",
    "Body",
    "Cam",
    "CoulombFriction",
    "CurrentSensor",
    "Dashpot",
    "DelayedForceSensor",
    "Domain",
    "Driven",
    "DrivenPoint",
    "Element",
    "Encoder",
    "Fixed",
    "FixedPoint",
    "ForceSensor",
    "GearedMotor",
    "Inertia",
    "LinearElastic",
    "Mass",
    "Parallel",
    "Part",
    "PullOnly",
    "Pulley",
    "Sensor",
    "Series",
    "SmoothStrainStiffening",
    "Specimen",
    "Spring",
    "StrainStiffening",
    "Through",
    "Tie",
    "TorsionDashpot",
    "TorsionSpring",
    "TwoSidedCam",
    "ViscousMaterial",
    "assembly",
    "control_values",
    "parallel",
    "pull_only",
    "series",
    "specimen",
    "through",
    "tie",
]
