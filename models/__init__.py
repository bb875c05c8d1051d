"""Systems, declared in Python with the numbers of a deck. Each function returns an Assembly."""

from .cam_rubber import cam_rubber_actuator
from .elastomer_specimen import elastomer_specimen
from .linear import linear_spring_actuator
from .one_sided_cable_drive import one_sided_cable_drive
from .positioning_drive import positioning_drive

__all__ = [
    "cam_rubber_actuator",
    "elastomer_specimen",
    "linear_spring_actuator",
    "one_sided_cable_drive",
    "positioning_drive",
]
