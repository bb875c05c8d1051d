"""Work shared among workers: this process, processes of this machine, a Dask scheduler, ranks of MPI.

Sweeps import it. It knows functions, points and workers, and nothing of what is computed; it is the only
room that may import ``distributed``, ``dask`` and ``mpi4py``.
"""

from .chunks import CodeIdentity, PointOutcome, code_identity
from .dask_scheduler import DaskScheduler
from .shared_map import parallel_map, shared_map, spread_over
from .teams import Executor, InThisProcess, MpiRanks, Processes

__all__ = [
    "CodeIdentity",
    "DaskScheduler",
    "Executor",
    "InThisProcess",
    "MpiRanks",
    "PointOutcome",
    "Processes",
    "code_identity",
    "parallel_map",
    "shared_map",
    "spread_over",
]
