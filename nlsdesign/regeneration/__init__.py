"""What takes several rooms: from one declared machine to everything that runs it.

Which commands a deck is ready for, observers that keep a size of flash, the observer designed again from the
better model of a diagnosis, and all files of a machine. Presentation and commands may import it; it decides
nothing that a room below can decide alone.
"""

from .exported_machine import MACHINE as MACHINE
from .exported_machine import ExportedMachine, export_machine
from .flash import SizedObserver, require_flash, sized_observer
from .range_remarks import beyond_contour as beyond_contour
from .range_remarks import range_remarks, swept_angle, usual_last
from .readiness import Readiness, readiness
from .regenerated_observer import ObserverChoice, Regeneration, regenerate, write_regeneration
from .running_errors import errors_while_running

__all__ = [
    "ExportedMachine",
    "ObserverChoice",
    "Readiness",
    "Regeneration",
    "SizedObserver",
    "errors_while_running",
    "export_machine",
    "range_remarks",
    "readiness",
    "regenerate",
    "require_flash",
    "sized_observer",
    "swept_angle",
    "usual_last",
    "write_regeneration",
]
