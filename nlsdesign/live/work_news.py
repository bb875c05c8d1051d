"""What a page is told of long work: its state, its stages, what came out; only where it has changed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from .answers import to_json
from .background import WorkState
from .exports import ExportDesign
from .full_design import FullDesign
from .live_design import LiveDesign
from .work import DiagnoseRecords, LiveTask, SettleDesign, ToleranceCloud, TorqueLoop

TASKS: Final[Mapping[str, Callable[[Path], LiveTask]]] = {
    SettleDesign.__name__: lambda _: SettleDesign(),
    ToleranceCloud.__name__: lambda _: ToleranceCloud(),
    TorqueLoop.__name__: lambda _: TorqueLoop(),
    DiagnoseRecords.__name__: DiagnoseRecords,
}
"""The kinds of work that a page may ask for, each made for a folder of records."""
_MOST_STAGES = 60


class WorkNews:
    """News of the work of one design.

    Parameters
    ----------
    live
        The design.
    records
        Folder of the records that were uploaded.
    """

    def __init__(self, live: LiveDesign, records: Path) -> None:
        self._live = live
        self._records = records
        self._last: dict[str, tuple[Any, ...]] = {}
        self._stages: dict[str, list[str]] = {}
        self._states: dict[str, WorkState] = {}
        self._began_with: dict[str, tuple[Any, ...]] = {}

    @property
    def running(self) -> bool:
        """Whether any work runs."""
        return any(each.state == "computing" for each in self._live.work.states())

    def start(self, name: str) -> None:
        """Start work of a kind."""
        task = TASKS[name](self._records)
        if isinstance(task, DiagnoseRecords):
            self._records.mkdir(parents=True, exist_ok=True)
        state = self._live.start(task)
        self._stages[name] = []
        self._began_with[name] = self._basis(name)
        self._noted(state)

    def stop(self, name: str) -> None:
        """End work of a kind."""
        state = self._live.work.cancel(name)
        if state is not None:
            self._noted(state)

    @property
    def export(self) -> WorkState | None:
        """How far the file is that was asked for last."""
        return next((each for each in self._live.work.states() if each.name == ExportDesign.__name__), None)

    def changed(self) -> list[dict[str, Any]]:
        """Return the news of all work that has changed; a whole design that is done has become the answer."""
        news = []
        for state in self._live.poll():
            if state.name not in TASKS:
                continue
            now = self._noted(state)
            if self._last.get(state.name) != now:
                self._last[state.name] = now
                news.append(self.of(state.name))
        return news

    def all(self) -> list[dict[str, Any]]:
        """Return the news of all work, as for a page that was loaded just now or showed another design."""
        return [self.of(name) for name in TASKS]

    def of(self, name: str) -> dict[str, Any]:
        """Return the news of work of a kind."""
        state = self._states.get(name)
        if state is None:
            return {"name": name, "state": "not begun", "message": "", "revision": 0, "seconds": 0.0,
                    "stages": [], "value": None, "old": False, **self._files(name)}  # fmt: skip
        # The whole design becomes the answer, and the loop is asked for angle by angle.
        shown = not isinstance(state.value, FullDesign) and name != TorqueLoop.__name__
        return {
            "name": name, "state": state.state, "message": state.message, "revision": state.revision,
            "seconds": state.seconds, "stages": self._stages.get(name, []),
            "value": to_json(state.value) if shown else None, "old": self._old(name), **self._files(name),
        }  # fmt: skip

    def _noted(self, state: WorkState) -> tuple[Any, ...]:
        """Keep a state and return what of it would be news."""
        self._states[state.name] = state
        stages = self._stages.setdefault(state.name, [])
        if state.state == "computing" and state.message and state.message not in stages[-1:]:
            stages.append(state.message)
            del stages[:-_MOST_STAGES]
        return state.state, state.message, state.revision, int(state.seconds), self._old(state.name)

    def _old(self, name: str) -> bool:
        """Tell whether work of a kind was begun for something else than what is there now."""
        return name in self._began_with and self._began_with[name] != self._basis(name)

    def _basis(self, name: str) -> tuple[Any, ...]:
        """Return what work of a kind is about: a diagnosis the records and the machine as it is declared."""
        live = self._live
        if name == DiagnoseRecords.__name__:
            # Points and limits belong to the design, not to the machine.
            return (_listed(self._records), live.question.machine, dict(live.question.given))
        design = live.answer.design
        return live.answer.revision, design is not None and design.checked

    def _files(self, name: str) -> dict[str, Any]:
        if name != DiagnoseRecords.__name__:
            return {}
        return {"files": [each[0] for each in _listed(self._records)]}


def _listed(folder: Path) -> list[tuple[str, int, int]]:
    """Return the records that are there: name, size and time; one that is being replaced is left out."""
    listed = []
    for file in sorted(folder.glob("*")):
        with contextlib.suppress(FileNotFoundError):
            seen = file.stat()
            listed.append((file.name, seen.st_size, seen.st_mtime_ns))
    return listed
