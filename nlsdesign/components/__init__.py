"""Parts that can be declared; they never learn what they are used for."""

from .ageing import StressSoftening, TensionSet, ViscousHeating, WorkHeating
from .arruda_boyce import ArrudaBoyce
from .assembly import Assembly, assembly
from .bodies import Body, Driven, DrivenPoint, Fixed, FixedPoint, GearedMotor, Inertia, Mass
from .bristles import LuGreFriction
from .cable import StretchyCable
from .cam import Cam, Pulley, TwoSidedCam, control_values
from .cam_shapes import AnchoredCam, OneSidedCam
from .capstan import CapstanFriction
from .contact import InextensibleCable
from .dampers import CoulombFriction, Dashpot, TorsionDashpot, ViscousMaterial
from .delay import DelayedForceSensor, DriftingForceSensor, TransportDelay
from .drives import DelayedMotor, SaturatingMotor
from .element import MATERIAL, ROTATION, TRANSLATION, Domain, Element, Parallel, parallel
from .encoders import EccentricEncoder
from .flowing import FlowingChains
from .friction import LoadFriction, QuadraticDrag, StribeckFriction, TorqueRipple
from .gear import Gear, LossyGear
from .guide import CableGuide
from .history import PermanentSet, Softening
from .hyperelastic import ExtendedTube, Hyperelastic, NeoHooke, Ogden, Yeoh
from .hysteresis import SlidingFillers
from .library import Material, Property, material, materials
from .misshapen import MisshapenCam
from .motor import CurrentDrivenMotor, ElectricMotor, VoltageDrivenMotor
from .networks import PullOnly, Specimen, Through, pull_only, specimen, through
from .part import Part
from .play import Backlash, InertialBacklash, LooseCable, Play, Slack, Turned
from .sampling import SampleAndHold, SampledEncoder, Tachometer
from .sensors import CurrentSensor, Encoder, ForceSensor, Sensor, TorqueSensor
from .series import Series, series
from .slide import ConstantForce, LinearDrive, SlidingFriction
from .smooth import Sharp, smoothed
from .springpot import Springpot
from .springs import LinearElastic, SmoothStrainStiffening, Spring, StrainStiffening, TorsionSpring
from .standard import burgers, generalised_maxwell, kelvin_voigt, maxwell, standard_linear_solid
from .sticking import DryFriction, DryLoadFriction, DryStribeckFriction
from .stops import EndStop, RigidStop, RoundedEndStop
from .thermal import ArrheniusShift, SelfHeating, WlfShift
from .tie import Tie, tie

__all__ = [
    "MATERIAL",
    "ROTATION",
    "TRANSLATION",
    "AnchoredCam",
    "ArrheniusShift",
    "ArrudaBoyce",
    "Assembly",
    "Backlash",
    "Body",
    "CableGuide",
    "Cam",
    "CapstanFriction",
    "ConstantForce",
    "CoulombFriction",
    "CurrentDrivenMotor",
    "CurrentSensor",
    "Dashpot",
    "DelayedForceSensor",
    "DelayedMotor",
    "Domain",
    "DriftingForceSensor",
    "Driven",
    "DrivenPoint",
    "DryFriction",
    "DryLoadFriction",
    "DryStribeckFriction",
    "EccentricEncoder",
    "ElectricMotor",
    "Element",
    "Encoder",
    "EndStop",
    "ExtendedTube",
    "Fixed",
    "FixedPoint",
    "FlowingChains",
    "ForceSensor",
    "Gear",
    "GearedMotor",
    "Hyperelastic",
    "Inertia",
    "InertialBacklash",
    "InextensibleCable",
    "LinearDrive",
    "LinearElastic",
    "LoadFriction",
    "LooseCable",
    "LossyGear",
    "LuGreFriction",
    "Mass",
    "Material",
    "MisshapenCam",
    "NeoHooke",
    "Ogden",
    "OneSidedCam",
    "Parallel",
    "Part",
    "PermanentSet",
    "Play",
    "Property",
    "PullOnly",
    "Pulley",
    "QuadraticDrag",
    "RigidStop",
    "RoundedEndStop",
    "SampleAndHold",
    "SampledEncoder",
    "SaturatingMotor",
    "SelfHeating",
    "Sensor",
    "Series",
    "Sharp",
    "Slack",
    "SlidingFillers",
    "SlidingFriction",
    "SmoothStrainStiffening",
    "Softening",
    "Specimen",
    "Spring",
    "Springpot",
    "StrainStiffening",
    "StressSoftening",
    "StretchyCable",
    "StribeckFriction",
    "Tachometer",
    "TensionSet",
    "Through",
    "Tie",
    "TorqueRipple",
    "TorqueSensor",
    "TorsionDashpot",
    "TorsionSpring",
    "TransportDelay",
    "Turned",
    "TwoSidedCam",
    "ViscousHeating",
    "ViscousMaterial",
    "VoltageDrivenMotor",
    "WlfShift",
    "WorkHeating",
    "Yeoh",
    "assembly",
    "burgers",
    "control_values",
    "generalised_maxwell",
    "kelvin_voigt",
    "material",
    "materials",
    "maxwell",
    "parallel",
    "pull_only",
    "series",
    "smoothed",
    "specimen",
    "standard_linear_solid",
    "through",
    "tie",
]
