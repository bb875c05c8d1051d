"""Work shared among workers: this process, processes of this machine, a Dask scheduler, ranks of MPI.

Sweeps import it. It knows functions, points and workers, and nothing of what is computed; it is the only
room that may import ``distributed``, ``dask`` and ``mpi4py``.
"""

from .chunks import CodeIdentity as CodeIdentity
from .chunks import PointOutcome as PointOutcome
from .chunks import code_identity as code_identity
from .dask_scheduler import DaskScheduler
from .shared_map import parallel_map, shared_map, spread_over
from .teams import Executor as Executor
from .teams import InThisProcess, Processes
from .teams import MpiRanks as MpiRanks

__all__ = [
    "DaskScheduler",
    "InThisProcess",
    "Processes",
    "parallel_map",
    "shared_map",
    "spread_over",
]
