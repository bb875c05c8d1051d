"""Systems, declared in Python with the numbers of a deck. Each function returns an Assembly."""

from models.cam_rubber import cam_rubber_actuator
from models.elastomer_specimen import elastomer_specimen
from models.linear import linear_spring_actuator
from models.one_sided_cable_drive import one_sided_cable_drive
from models.positioning_drive import positioning_drive

__all__ = [
    "cam_rubber_actuator",
    "elastomer_specimen",
    "linear_spring_actuator",
    "one_sided_cable_drive",
    "positioning_drive",
]
