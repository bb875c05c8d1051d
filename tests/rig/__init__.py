"""A bench rig simulated without any model code of the package: records with hidden effects.

The bench turns the cam of a cam–rubber actuator by a servo, with the load side held fast, and records
angle, current and force.  Its formulations are chosen to differ from those of a smooth symbolic model:
friction, gear backlash and cable are set-valued laws advanced by impulses, hysteresis is a set of dry
sliders, the step is fixed at 20 kHz.  Only numpy and the standard library are used.

>>> records = make_records(ACTUATORS["arm"], {"coulomb_friction": 1.0}, seed=3)
"""

from .actuators import ACTUATORS, Actuator, with_slack_cable
from .conditions import COUNTS, PLAIN, THREE_RECORDS, Conditions, mistaken
from .declaration import write_collection, write_declaration, write_records, write_set
from .effects import EFFECTS, LATER_EFFECTS, OUTSIDE_ANY_CATALOGUE, STRENGTHS, Hidden
from .records import make_records, truth

__all__ = [
    "ACTUATORS",
    "COUNTS",
    "EFFECTS",
    "LATER_EFFECTS",
    "OUTSIDE_ANY_CATALOGUE",
    "PLAIN",
    "STRENGTHS",
    "THREE_RECORDS",
    "Actuator",
    "Conditions",
    "Hidden",
    "make_records",
    "mistaken",
    "truth",
    "with_slack_cable",
    "write_collection",
    "write_declaration",
    "write_records",
    "write_set",
]
