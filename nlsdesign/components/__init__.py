"""Parts that can be declared; they never learn what they are used for."""

from .assembly import Assembly, assembly
from .bodies import Body, Driven, DrivenPoint, Fixed, FixedPoint, GearedMotor, Inertia, Mass
from .cable import StretchyCable
from .cam import Cam, Pulley, TwoSidedCam, control_values
from .contact import InextensibleCable
from .dampers import CoulombFriction, Dashpot, TorsionDashpot, ViscousMaterial
from .delay import DelayedForceSensor, DriftingForceSensor, TransportDelay
from .element import MATERIAL, ROTATION, TRANSLATION, Domain, Element, Parallel, Series, parallel, series
from .friction import LoadFriction, QuadraticDrag, StribeckFriction, TorqueRipple
from .hyperelastic import ExtendedTube, Hyperelastic, NeoHooke, Ogden, Yeoh
from .hysteresis import SlidingFillers
from .networks import PullOnly, Specimen, Through, pull_only, specimen, through
from .part import Part
from .play import Backlash, Slack, Turned
from .sampling import SampleAndHold, SampledEncoder, Tachometer
from .sensors import CurrentSensor, Encoder, ForceSensor, Sensor, TorqueSensor
from .slide import ConstantForce, LinearDrive, SlidingFriction
from .springs import LinearElastic, SmoothStrainStiffening, Spring, StrainStiffening, TorsionSpring
from .tie import Tie, tie

__all__ = [
    "MATERIAL",
    "ROTATION",
    "TRANSLATION",
    "Assembly",
    "Backlash",
    "Body",
    "Cam",
    "ConstantForce",
    "CoulombFriction",
    "CurrentSensor",
    "Dashpot",
    "DelayedForceSensor",
    "Domain",
    "DriftingForceSensor",
    "Driven",
    "DrivenPoint",
    "Element",
    "Encoder",
    "ExtendedTube",
    "Fixed",
    "FixedPoint",
    "ForceSensor",
    "GearedMotor",
    "Hyperelastic",
    "Inertia",
    "InextensibleCable",
    "LinearDrive",
    "LinearElastic",
    "LoadFriction",
    "Mass",
    "NeoHooke",
    "Ogden",
    "Parallel",
    "Part",
    "PullOnly",
    "Pulley",
    "QuadraticDrag",
    "SampleAndHold",
    "SampledEncoder",
    "Sensor",
    "Series",
    "Slack",
    "SlidingFillers",
    "SlidingFriction",
    "SmoothStrainStiffening",
    "Specimen",
    "Spring",
    "StrainStiffening",
    "StretchyCable",
    "StribeckFriction",
    "Tachometer",
    "Through",
    "Tie",
    "TorqueRipple",
    "TorqueSensor",
    "TorsionDashpot",
    "TorsionSpring",
    "TransportDelay",
    "Turned",
    "TwoSidedCam",
    "ViscousMaterial",
    "Yeoh",
    "assembly",
    "control_values",
    "parallel",
    "pull_only",
    "series",
    "specimen",
    "through",
    "tie",
]
