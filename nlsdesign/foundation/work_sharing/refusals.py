"""Work that cannot be sent, and workers that are refused."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

from ..errors import WorkSharingError
from .chunks import WorkerRefusal, reason_of
from .identity import code_identity


def refused(refusal: WorkerRefusal) -> WorkSharingError:
    """Return the error for a worker whose code is another one; it names both."""
    return WorkSharingError(
        f"worker {refusal.worker}",
        f"runs {refusal.identity}, and this program {code_identity()}: their answers must not be mixed",
        next_step="install the same version at the workers and here, and start the workers again",
    )


def sendable(work: Callable[[Any], Any]) -> bytes:
    """Return work as bytes for another machine; functions of a script or notebook go with their code."""
    try:
        import cloudpickle as library
    except ModuleNotFoundError:
        library = pickle
    try:
        content: bytes = library.dumps(work, protocol=pickle.HIGHEST_PROTOCOL)
    except WorkSharingError:  # of a part of it, which says more
        raise
    except Exception as error:  # whatever an object answers to being pickled
        raise WorkSharingError(
            "the work", f"cannot be sent to workers: {reason_of(error)}",
            next_step="take a function of a module, without open files, locks or connections",
        ) from None  # fmt: skip
    return content
