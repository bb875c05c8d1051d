"""A Dask scheduler that somebody else has started, with workers anywhere.

The scheduler gives a chunk to another worker by itself when one dies, and says so when it has seen several
die over one chunk. If the scheduler is gone, this side connects again for a stated time and gives it the
chunks that were under way once more; each has one record, whichever attempt gave it.
"""

from __future__ import annotations

import contextlib
import json
import logging
import queue
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from secrets import token_hex
from typing import Any, Final

from ..errors import ValueRangeError, WorkSharingError, missing_library
from ..text_files import is_there, text_of
from .chunks import (
    Chunk,
    ChunkLoss,
    CodeIdentity,
    WorkerRefusal,
    computed_elsewhere,
    outcomes_in,
    own_identity,
    reason_of,
    refused,
    sendable,
)
from .teams import Finished, Team

_CHUNKS_PER_WORKER: Final = 2
_AGAIN: Final = 0.5
"""Seconds between attempts to connect again."""


@dataclass(frozen=True)
class DaskScheduler:
    """Workers of a Dask scheduler, named by its address or by the file that it wrote.

    Parameters
    ----------
    address
        For instance ``"tcp://10.0.0.1:8786"``.
    file
        Scheduler file, in place of the address.
    connect_within
        Seconds that the scheduler may take to answer at the start.
    patience
        Seconds that a scheduler that is gone, or one without workers, is waited for.

    Raises
    ------
    ValueRangeError
        If neither or both are given.
    """

    address: str = ""
    file: Path | None = None
    connect_within: float = 5.0
    patience: float = 120.0

    def __post_init__(self) -> None:
        if bool(self.address) == (self.file is not None):
            raise ValueRangeError(
                "Dask scheduler", "has an address or a file, one of both",
                next_step="give for instance tcp://10.0.0.1:8786",
            )  # fmt: skip

    @property
    def named(self) -> str:
        """Address or file, for messages."""
        return self.address or str(self.file)

    @contextmanager
    def team(self, work: Callable[[Any], Any]) -> Iterator[Team]:
        """Yield the workers of the scheduler, which get the work pickled, and live on without it.

        Raises
        ------
        MissingLibraryError
            If distributed is not installed.
        WorkSharingError
            If the scheduler does not answer, or a worker runs other code.
        """
        payload = sendable(work)
        team = _Team(self, payload)
        try:
            yield team
        finally:
            team.end()

    def connected(self, seconds: float) -> Any:
        """Return a client of ``distributed``.

        Parameters
        ----------
        seconds
            That the scheduler may take to answer.

        Raises
        ------
        MissingLibraryError
            If distributed is not installed.
        WorkSharingError
            If it does not answer, or another version of Dask does.
        """
        try:
            import distributed
        except ModuleNotFoundError:
            raise missing_library("a Dask scheduler", "distributed", "scale") from None
        if self.file is not None:
            # Refuse a file that no scheduler wrote before Dask begins, which complains of it at its end too.
            file = self.file
            step = "name the file that the scheduler wrote (dask scheduler --scheduler-file FILE)"
            if not is_there(file):
                raise WorkSharingError(str(file), "no such file", next_step=step)
            try:
                content = json.loads(text_of(file, WorkSharingError))
            except ValueError:
                content = None
            if not isinstance(content, dict) or not isinstance(content.get("address"), str):
                raise WorkSharingError(
                    str(file), "is no file of a Dask scheduler: it holds no address", next_step=step
                )
        where = {"scheduler_file": str(self.file)} if self.file is not None else {"address": self.address}
        # Its own words on lost connections would stand between ours.
        for name in ("distributed.client", "distributed.core", "distributed.comm"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            make: Any = distributed.Client
            return make(**where, timeout=seconds, set_as_default=False)
        except Exception as error:  # of sockets, of TLS, of a damaged file
            raise WorkSharingError(
                f"Dask scheduler {self.named}", f"does not answer within {seconds:g} s ({reason_of(error)})",
                next_step="start it with 'dask scheduler', or leave --scheduler out to use this machine",
            ) from None  # fmt: skip


class _Team:
    def __init__(self, scheduler: DaskScheduler, payload: bytes) -> None:
        self._scheduler, self._payload = scheduler, payload
        self._expected = own_identity()
        self._numbers = count()
        self._flying: dict[str, tuple[Any, Chunk]] = {}
        self._ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._without_workers: float | None = None
        self._client = self._checked(scheduler.connect_within)

    def _checked(self, seconds: float) -> Any:
        """Return a client whose workers all run this code."""
        client = self._scheduler.connected(seconds)
        try:
            answers = client.run(own_identity, on_error="return")
        except Exception:  # the scheduler went away while it was asked; that is noticed soon enough
            answers = {}
        for worker, identity in answers.items():
            wrong = None
            if not isinstance(identity, CodeIdentity):
                wrong = WorkSharingError(
                    f"worker {worker}", f"cannot load this version of nlsdesign ({reason_of(identity)})",
                    next_step=f"install {self._expected} at the workers and start them again",
                )  # fmt: skip
            elif identity != self._expected:
                wrong = refused(WorkerRefusal(worker, identity))
            if wrong is not None:
                client.close()
                raise wrong
        return client

    def workers(self) -> int:
        # The client keeps this list up to date by itself.
        return len(self._client.scheduler_info(n_workers=-1)["workers"]) if self._alive() else 0

    def _alive(self) -> bool:
        return str(self._client.status) == "running"

    def free(self) -> int:
        return _CHUNKS_PER_WORKER * max(1, self.workers()) - len(self._flying)

    def submit(self, chunk: Chunk) -> None:
        key = f"nlsdesign-{token_hex(8)}-{next(self._numbers)}"
        with contextlib.suppress(
            Exception
        ):  # a client that was cut off; the chunk is lost then, not its points
            future = self._client.submit(
                computed_elsewhere, self._payload, chunk, self._expected, key=key, pure=False, retries=0
            )
            self._flying[key] = (future, chunk)
            future.add_done_callback(self._ended.put)
            return
        self._flying[key] = (None, chunk)

    def finished(self, seconds: float) -> list[Finished]:
        if not self._alive():
            return self._connected_again()
        ended: list[Any] = []
        with contextlib.suppress(queue.Empty):
            ended.append(self._ended.get(timeout=seconds))
            while True:
                ended.append(self._ended.get_nowait())
        finished: list[Finished] = []
        for future in ended:
            if future.key in self._flying:
                outcome = _outcome(future)
                if isinstance(outcome, ChunkLoss) and not self._alive():
                    return finished + self._connected_again()
                finished.append((self._flying.pop(future.key)[1], outcome))
        self._look_for_workers(bool(finished))
        return finished

    def _look_for_workers(self, moving: bool) -> None:
        """End with a message when there has been no worker for a long time."""
        if moving or self.workers():
            self._without_workers = None
            return
        now = time.monotonic()
        self._without_workers = self._without_workers or now
        if now - self._without_workers > self._scheduler.patience:
            raise WorkSharingError(
                f"Dask scheduler {self._scheduler.named}",
                f"has had no worker for {self._scheduler.patience:g} s",
                next_step="start workers with 'dask worker', and run the same command again: it resumes",
            )

    def _connected_again(self) -> list[Finished]:
        """Connect to a scheduler that was gone; what was under way is given again."""
        begin = time.monotonic()
        self._close()
        while True:
            left = self._scheduler.patience - (time.monotonic() - begin)
            try:
                self._client = self._checked(max(1.0, min(5.0, left)))
                break
            except WorkSharingError as error:
                if "does not answer" not in error.rule:
                    raise
                if left <= 0.0:
                    raise WorkSharingError(
                        f"Dask scheduler {self._scheduler.named}",
                        f"was lost and did not come back within {self._scheduler.patience:g} s",
                        next_step="what is finished is kept: run the same command again when it is there",
                    ) from None
            time.sleep(_AGAIN)
        lost = [chunk for _, chunk in self._flying.values()]
        self._flying, self._ended = {}, queue.SimpleQueue()
        return [(chunk, ChunkLoss("its scheduler was lost", deaths=0)) for chunk in lost]

    def _close(self) -> None:
        with contextlib.suppress(Exception):  # a client without a scheduler complains while it closes
            self._client.close(timeout=2.0)

    def end(self) -> None:
        with contextlib.suppress(Exception):
            if self._alive():
                self._client.cancel([future for future, _ in self._flying.values() if future is not None])
        self._close()


def _outcome(future: Any) -> list[Any] | ChunkLoss:
    """Return the outcomes of a chunk, or what became of it."""
    from distributed import KilledWorker

    try:
        answer = future.result(timeout=60.0)
    except KilledWorker as error:
        # The scheduler has tried it on several workers by itself.
        deaths = 1 + int(getattr(error, "allowed_failures", 3))
        return ChunkLoss("each died over it, says the scheduler", deaths=deaths)
    except Exception as error:
        if future.status == "error":
            raise WorkSharingError(
                "workers", f"cannot do the work: {reason_of(error)}",
                next_step="make sure that they can import whatever the question uses",
            ) from None  # fmt: skip
        return ChunkLoss(reason_of(error), deaths=0)
    return outcomes_in(answer)
