"""Parts that can be declared; they never learn what they are used for."""

from typing import TYPE_CHECKING

from .assembly.changed_copies import sharpened as sharpened
from .assembly.changed_copies import smoothed
from .assembly.changed_copies import with_moved_load as with_moved_load
from .assembly.circuit import draw as draw
from .assembly.deck_reader import component_classes as component_classes
from .assembly.deck_remarks import deck_remarks as deck_remarks
from .assembly.deck_template import GIVEN as GIVEN
from .assembly.deck_template import AskedNumber as AskedNumber
from .assembly.deck_template import DeckTemplate as DeckTemplate
from .assembly.deck_template import MotorInertia as MotorInertia
from .assembly.deck_template import load_template as load_template
from .assembly.deck_template import motor_inertia as motor_inertia
from .assembly.deck_template import plain_name as plain_name
from .assembly.deck_writer import deck_digest as deck_digest
from .assembly.deck_writer import deck_problems as deck_problems
from .assembly.deck_writer import deck_text as deck_text
from .assembly.deck_writer import declare as declare
from .assembly.deck_writer import write_deck as write_deck
from .assembly.library_rubber import with_rubber
from .assembly.named_parts import Assembly, assembly
from .assembly.part_text import renamed as renamed
from .core.contacts import Regularised, Rounded, Sharp
from .core.domain import MATERIAL, ROTATION, TRANSLATION, Domain
from .core.element import Element, Parallel, Tie, parallel, tie
from .core.part import ParameterInfo as ParameterInfo
from .core.part import Part
from .core.part_numbers import NotDeclared
from .core.series import Series, series
from .core.springs import Dashpot, FittedRange, LinearElastic, Spring, StrainStiffening, ViscousMaterial
from .materials.arruda_boyce import ArrudaBoyce
from .materials.finite_viscoelasticity import FlowingChains
from .materials.hardening import HardeningSpring, SoftWindup
from .materials.hyperelastic import ExtendedTube, Hyperelastic, NeoHooke, Ogden, Yeoh
from .materials.loss_tangent import (
    KnownLoss,
    Relaxation,
    flat_relaxation,
    loss_of,
    measured_relaxation,
    peaked_relaxation,
    relaxing_law_of,
    relaxing_rubber_of,
)
from .materials.material_law import material_laws as material_laws
from .materials.material_law import rubber_of
from .materials.named_networks import (
    burgers,
    generalised_maxwell,
    kelvin_voigt,
    maxwell,
    standard_linear_solid,
)
from .materials.permanent_set import Following, PermanentSet, Rising
from .materials.quasilinear import QuasilinearRelaxation
from .materials.rate_independent import SlidingFillers
from .materials.self_heating import HeatBalance, LossHeat, SelfHeating, ViscousHeat, WorkHeat
from .materials.smooth_hysteresis import BoucWen
from .materials.specimen import Area, Specimen, Strip, specimen
from .materials.springpot import Springpot
from .materials.stress_softening import DamageByMotion, LargestMotion, OgdenRoxburgh, StressSoftening
from .materials.time_shift import ArrheniusShift, WlfShift
from .mechanics.backlash import Backlash, Inertial, Slack, Turned
from .mechanics.bodies import Driven, Fixed, GearedMotor, Inertia, Mass
from .mechanics.carriage import LinearDrive
from .mechanics.coils import (
    CoilMass,
    CompressionCoil,
    ExtensionCoil,
    StatedRate,
    Winding,
    WireStrength,
    torsion_coil,
)
from .mechanics.controllers import Integral, PositionLoop, RateFeedback, SpeedLoop
from .mechanics.drive_chain import DriveDelay, DriveLag, DrivePart, DriveSaturation
from .mechanics.drive_faults import (
    CommandCompression,
    CommandSaturation,
    GradualSaturation,
    TorqueConstantDrift,
    WindingHeat,
)
from .mechanics.friction import (
    AsymmetricFriction,
    CoulombFriction,
    GearFriction,
    LoadFriction,
    QuadraticDrag,
    StribeckFriction,
)
from .mechanics.gear import Gear, LossyGear, Rack, Screw
from .mechanics.loads import ConstantLoad, GravityLoad, HorizontalTorque, MassOnArm
from .mechanics.lugre import LuGreFriction
from .mechanics.motor import CurrentDrivenMotor, ResistiveMotor, VoltageDrivenMotor
from .mechanics.place_friction import SpotFriction, WavyFriction
from .mechanics.ripple import TorqueRipple
from .mechanics.stops import EndStop, RigidStop
from .mechanics.unnamed import UnnamedFriction, UnnamedSpring
from .sensing.sampled_sensors import SampleAndHold, Tachometer
from .sensing.sensor_faults import (
    ClockDrift,
    Drift,
    Eccentricity,
    EncoderOffset,
    LoadNonlinearity,
    TransportDelay,
)
from .sensing.sensors import CurrentSensor, Encoder, ForceSensor, ReadingLimits, Sensor, TorqueSensor
from .transmission.cam import Cable, Cam, Pulley, TwoSidedCam, control_values
from .transmission.cam_drive import Through, through
from .transmission.cam_error import CamWithProfileError
from .transmission.cam_shapes import AnchoredCam, OneSidedCam
from .transmission.capstan import CapstanFriction, Guide, WrapProduct
from .transmission.lopsided_cam import LopsidedCam
from .transmission.roller_cam import RollerCam, SlidingGuide
from .transmission.stretchy_cable import StretchyCable
from .transmission.unilateral_cable import Buckling, InextensibleCable, PullOnly, pull_only

# isort: split
# Last: the first import from the inner room ``materials`` puts the room at the name of this function.
from ..foundation.rubber_library import CONDITIONS as CONDITIONS
from ..foundation.rubber_library import Material, material, materials

__all__ = [
    "MATERIAL",
    "ROTATION",
    "TRANSLATION",
    "AnchoredCam",
    "Area",
    "ArrheniusShift",
    "ArrudaBoyce",
    "Assembly",
    "AsymmetricFriction",
    "Backlash",
    "BoucWen",
    "Buckling",
    "Cable",
    "Cam",
    "CamWithProfileError",
    "CapstanFriction",
    "ClockDrift",
    "CoilMass",
    "CommandCompression",
    "CommandSaturation",
    "CompressionCoil",
    "ConstantLoad",
    "CoulombFriction",
    "CurrentDrivenMotor",
    "CurrentSensor",
    "DamageByMotion",
    "Dashpot",
    "Domain",
    "Drift",
    "DriveDelay",
    "DriveLag",
    "DrivePart",
    "DriveSaturation",
    "Driven",
    "Eccentricity",
    "Element",
    "Encoder",
    "EncoderOffset",
    "EndStop",
    "ExtendedTube",
    "ExtensionCoil",
    "FittedRange",
    "Fixed",
    "FlowingChains",
    "Following",
    "ForceSensor",
    "Gear",
    "GearFriction",
    "GearedMotor",
    "GradualSaturation",
    "GravityLoad",
    "Guide",
    "HardeningSpring",
    "HeatBalance",
    "HorizontalTorque",
    "Hyperelastic",
    "Inertia",
    "Inertial",
    "InextensibleCable",
    "Integral",
    "KnownLoss",
    "LargestMotion",
    "LinearDrive",
    "LinearElastic",
    "LoadFriction",
    "LoadNonlinearity",
    "LopsidedCam",
    "LossHeat",
    "LossyGear",
    "LuGreFriction",
    "Mass",
    "MassOnArm",
    "Material",
    "NeoHooke",
    "NotDeclared",
    "Ogden",
    "OgdenRoxburgh",
    "OneSidedCam",
    "Parallel",
    "Part",
    "PermanentSet",
    "PositionLoop",
    "PullOnly",
    "Pulley",
    "QuadraticDrag",
    "QuasilinearRelaxation",
    "Rack",
    "RateFeedback",
    "ReadingLimits",
    "Regularised",
    "Relaxation",
    "ResistiveMotor",
    "RigidStop",
    "Rising",
    "RollerCam",
    "Rounded",
    "SampleAndHold",
    "Screw",
    "SelfHeating",
    "Sensor",
    "Series",
    "Sharp",
    "Slack",
    "SlidingFillers",
    "SlidingGuide",
    "SoftWindup",
    "Specimen",
    "SpeedLoop",
    "SpotFriction",
    "Spring",
    "Springpot",
    "StatedRate",
    "StrainStiffening",
    "StressSoftening",
    "StretchyCable",
    "StribeckFriction",
    "Strip",
    "Tachometer",
    "Through",
    "Tie",
    "TorqueConstantDrift",
    "TorqueRipple",
    "TorqueSensor",
    "TransportDelay",
    "Turned",
    "TwoSidedCam",
    "UnnamedFriction",
    "UnnamedSpring",
    "ViscousHeat",
    "ViscousMaterial",
    "VoltageDrivenMotor",
    "WavyFriction",
    "Winding",
    "WindingHeat",
    "WireStrength",
    "WlfShift",
    "WorkHeat",
    "WrapProduct",
    "Yeoh",
    "assembly",
    "burgers",
    "control_values",
    "flat_relaxation",
    "generalised_maxwell",
    "kelvin_voigt",
    "loss_of",
    "material",
    "materials",
    "maxwell",
    "measured_relaxation",
    "parallel",
    "peaked_relaxation",
    "pull_only",
    "relaxing_law_of",
    "relaxing_rubber_of",
    "rubber_of",
    "series",
    "smoothed",
    "specimen",
    "standard_linear_solid",
    "through",
    "tie",
    "torsion_coil",
    "with_rubber",
]

if not TYPE_CHECKING:  # a type checker would take any misspelt name for a part

    def __getattr__(name: str) -> type[Part]:
        """Return a component that is in no list; of one that had another name, say the new one."""
        error = renamed(name)
        if error is not None:
            raise error
        # A law is found by standing in a file of a room; the list above is for type checkers and readers.
        law = None if name.startswith("_") else component_classes().get(name)
        if law is None:
            raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
        return law
