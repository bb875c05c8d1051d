"""Parts that can be declared; they never learn what they are used for."""

from __future__ import annotations

from typing import NoReturn

from .assembly.named_parts import Assembly, assembly
from .assembly.renamed import renamed
from .assembly.smooth_form import Sharp, smoothed
from .core.dampers import CoulombFriction, Dashpot, TorsionDashpot, ViscousMaterial
from .core.element import MATERIAL, ROTATION, TRANSLATION, Domain, Element, Parallel, parallel
from .core.part import Part
from .core.series import Series, series
from .core.springs import LinearElastic, SmoothStrainStiffening, Spring, StrainStiffening, TorsionSpring
from .core.tie import Tie, tie
from .materials.arruda_boyce import ArrudaBoyce
from .materials.finite_viscoelasticity import FlowingChains
from .materials.hyperelastic import ExtendedTube, Hyperelastic, NeoHooke, Ogden, Yeoh
from .materials.library import Material, Property, material, materials
from .materials.material_memory import StressSoftening, TensionSet, ViscousHeating, WorkHeating
from .materials.named_networks import (
    burgers,
    generalised_maxwell,
    kelvin_voigt,
    maxwell,
    standard_linear_solid,
)
from .materials.rate_independent import SlidingFillers
from .materials.springpot import Springpot
from .materials.stress_softening import PermanentSet, Softening
from .materials.thermal import ArrheniusShift, SelfHeating, WlfShift
from .mechanics.backlash import Backlash, InertialBacklash, LooseCable, Play, Slack, Turned
from .mechanics.bodies import Body, Driven, DrivenPoint, Fixed, FixedPoint, GearedMotor, Inertia, Mass
from .mechanics.carriage import ConstantForce, LinearDrive, SlidingFriction
from .mechanics.drive_chain import DriveDelay, DrivePart, DriveSaturation
from .mechanics.dry_friction import DryFriction, DryLoadFriction, DryStribeckFriction
from .mechanics.friction import LoadFriction, QuadraticDrag, StribeckFriction, TorqueRipple
from .mechanics.gear import Gear, LossyGear
from .mechanics.lugre import LuGreFriction
from .mechanics.motor import CurrentDrivenMotor, ElectricMotor, VoltageDrivenMotor
from .mechanics.stops import EndStop, RigidStop, RoundedEndStop
from .sensing.sampled_sensors import SampleAndHold, Tachometer
from .sensing.sensor_faults import Drift, Eccentricity, TransportDelay
from .sensing.sensors import CurrentSensor, Encoder, ForceSensor, Sensor, TorqueSensor
from .transmission.cable_guide import CableGuide
from .transmission.cam import Cam, Pulley, TwoSidedCam, control_values
from .transmission.cam_drive import PullOnly, Specimen, Through, pull_only, specimen, through
from .transmission.cam_error import MisshapenCam
from .transmission.cam_shapes import AnchoredCam, OneSidedCam
from .transmission.capstan import CapstanFriction
from .transmission.stretchy_cable import StretchyCable
from .transmission.unilateral_cable import InextensibleCable

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
    "Domain",
    "Drift",
    "DriveDelay",
    "DrivePart",
    "DriveSaturation",
    "Driven",
    "DrivenPoint",
    "DryFriction",
    "DryLoadFriction",
    "DryStribeckFriction",
    "Eccentricity",
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


def __getattr__(name: str) -> NoReturn:
    """Say the new name of a component that had another one."""
    error = renamed(name)
    raise error or AttributeError(f"module '{__name__}' has no attribute '{name}'")
