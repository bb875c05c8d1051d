"""What takes several rooms: from one declared machine to everything that runs it.

Which commands a deck is ready for, observers that keep a size of flash, the observer designed again from the
better model of a diagnosis, the published observer with poles from records, what a monitor computes and what
its evidence says, and all files of a machine. Presentation and commands may import it; it decides nothing
that a room below can decide alone.
"""

from .exported_machine import MACHINE as MACHINE
from .exported_machine import export_machine
from .fitted_poles import FittedPoles as FittedPoles
from .fitted_poles import fit_poles
from .flash import require_flash as require_flash
from .flash import require_time as require_time
from .flash import sized_observer
from .loadable_code import CodeRecipe, SameTable, block_for
from .readiness import Readiness as Readiness
from .readiness import beyond_contour as beyond_contour
from .readiness import errors_while_running as errors_while_running
from .readiness import range_remarks, readiness
from .readiness import swept_angle as swept_angle
from .readiness import usual_last as usual_last
from .regenerated_controller import RegeneratedController as RegeneratedController
from .regenerated_observer import Regeneration, regenerate, write_regeneration
from .watch_model import watch_plan
from .watch_reading import read_watch
from .watched_records import ObserverChoice

__all__ = [
    "CodeRecipe",
    "ObserverChoice",
    "Regeneration",
    "SameTable",
    "block_for",
    "export_machine",
    "fit_poles",
    "range_remarks",
    "read_watch",
    "readiness",
    "regenerate",
    "sized_observer",
    "watch_plan",
    "write_regeneration",
]
