"""The folder of a sweep: what it holds, whether a run may go on in it, and that only one run does.

All points of a sweep: every row of each set of axes with every row of the others, one at a time.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import json
import math
import os
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..components.assembly.deck_writer import deck_digest, deck_text
from ..components.assembly.named_parts import Assembly
from ..foundation.errors import ExportError, MeasurementError, ValueRangeError
from ..foundation.text_files import make_folder, write_text
from ..foundation.work_sharing import CodeIdentity, code_identity
from .axes import AxisSet
from .axis_values import Subject, row_of_factor
from .sweep_columns import (
    RESULTS_FILE,
    SALTELLI,
    SweepColumn,
    arrow_column,
    libraries,
    numpy_column,
    read_columns,
)
from .sweep_parts import PARTS_FOLDER, TIMINGS_FILE, Parts, part_files, rows_in_order
from .sweep_table import ABOUT_FILE, DECK_FILE, DECKS_FOLDER, about_text, read_about

_PROBES = 64
_MOST_POINTS = 100_000_000


class PointPlan:
    """Points by number; the last set of axes changes first."""

    def __init__(self, axes: Sequence[AxisSet], subject: Subject) -> None:
        if not axes:
            raise ValueRangeError(
                "sweep", "has no axes", next_step="give one, such as GridAxis or SobolSample"
            )
        self._sets = [each.bound(subject) for each in axes]
        count = math.prod(each.count for each in self._sets)
        if count > _MOST_POINTS:
            raise ValueRangeError(
                f"sweep of {count:.4g} points", f"has more than {_MOST_POINTS}, for which no driver has room",
                next_step="split it by an axis, with a folder for each stretch",
            )  # fmt: skip
        self.columns: tuple[SweepColumn, ...] = tuple(c for each in self._sets for c in each.columns)
        # Refuse axes that change the same number.
        for name, times in Counter(column.name for column in self.columns).items():
            if times > 1:
                raise ValueRangeError(
                    f"axis '{name}'", f"stands {times} times: its points collide",
                    next_step="keep one of them",
                )  # fmt: skip
        names = {column.name for column in self.columns}
        for name in names:
            row = row_of_factor(name)
            inside = sorted(each for each in names if row is not None and each.partition("[")[0] == row)
            if inside:
                raise ValueRangeError(
                    f"axes '{name}' and '{inside[0]}'", "change the same number: their points collide",
                    next_step="keep one of them",
                )  # fmt: skip
        # Refuse a Saltelli plan that is crossed: crossed blocks are no plan, and what they give is no share.
        for plan in self._sets:
            others = [
                c.name for each in self._sets if each is not plan and each.count > 1 for c in each.columns
            ]
            if others and any(column.kind == SALTELLI for column in plan.columns):
                raise ValueRangeError(
                    f"Saltelli sample over {', '.join(column.name for column in plan.columns)}",
                    f"is crossed with axis {', '.join(others)}: shares of the variance need it to be alone",
                    next_step="put a number among its ranges, and give each word a sweep and a folder of its "
                    "own",
                )  # fmt: skip

    def __len__(self) -> int:
        return math.prod(each.count for each in self._sets)

    def point(self, number: int) -> tuple[Any, ...]:
        """Return the values of a point, in the order of the columns."""
        rows: list[tuple[Any, ...]] = []
        for each in reversed(self._sets):
            number, inner = divmod(number, each.count)
            rows.append(each.row(inner))
        return tuple(value for row in reversed(rows) for value in row)

    def points(self) -> Iterator[tuple[int, tuple[Any, ...]]]:
        """Yield all points with their numbers."""
        return ((number, self.point(number)) for number in range(len(self)))

    def words(self) -> dict[str, tuple[str, ...]]:
        """Return the words of each axis that holds words, each once, in their order."""
        known: dict[str, tuple[str, ...]] = {}
        for each in self._sets:
            for place, column in enumerate(each.columns):
                if column.lower is None:
                    rows = (str(each.row(k)[place]) for k in range(each.count))
                    known[column.name] = tuple(dict.fromkeys(rows))
        return known

    def digest(self) -> str:
        """Return the SHA-256 of the plan: its columns, its size, and points all over it."""
        count = len(self)
        probes = sorted({round(k * (count - 1) / (_PROBES - 1)) for k in range(_PROBES)})
        content: list[Any] = [[asdict(c) for c in self.columns], count, [each.count for each in self._sets]]
        content.append([[k, *map(repr, self.point(k))] for k in probes])
        for each in self._sets:
            if each.count <= _PROBES**2:
                content.append([list(map(repr, each.row(k))) for k in range(each.count)])
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()


CODE_FILE: Final = "code.json"
LOCK_FILE: Final = ".running"
_LIBRARIES: Final = ("casadi", "numpy", "scipy")
_LOCK_SECONDS: Final = 5.0
_SHOWN: Final = 4


def about_sweep(
    assemblies: Mapping[str, Assembly], plan: PointPlan, *, question: str, asked: str, seeds: list[int]
) -> dict[str, Any]:
    """Return what ``sweep.json`` says of a sweep; the same wherever it is computed.

    ``assemblies``: by the name of their deck; the first is swept.
    """
    code = code_identity()
    first, base = next(iter(assemblies.items()))
    return {
        "question": question,
        "asked": hashlib.sha256(asked.encode()).hexdigest(),
        "deck": first,
        "digest": deck_digest(base),
        "decks": {name: deck_digest(each) for name, each in assemblies.items()},
        "version": code.version,
        "code": code.digest,
        "libraries": {name: importlib.metadata.version(name) for name in _LIBRARIES},
        "seed": seeds[0] if seeds else None,
        "seeds": seeds,
        "points": len(plan),
        "plan": plan.digest(),
    }


def contents_of(
    words: Mapping[str, Sequence[str]], stands_for: Callable[[str, str], str]
) -> dict[str, dict[str, str]]:
    """Return a digest of what the words of axes stand for, by axis and word; nothing for mere words."""
    known = {name: {text: stands_for(name, text) for text in given} for name, given in words.items()}
    return {name: given for name, given in known.items() if any(given.values())}


@contextlib.contextmanager
def only_run(folder: Path) -> Iterator[None]:
    """Make the folder and hold it for this run until the end of the block, or of this process."""
    make_folder(folder)
    try:
        handle = os.open(folder / LOCK_FILE, os.O_CREAT | os.O_RDWR, 0o644)
    except OSError as error:
        raise ExportError(
            str(folder), f"cannot be written ({error.strerror})", next_step="name another folder"
        ) from None
    try:
        _lock(handle, folder)
        yield
    finally:
        os.close(handle)


def _lock(handle: int, folder: Path) -> None:
    try:
        import fcntl
    except ModuleNotFoundError:  # of Windows: two runs in one folder are not noticed there
        return
    end = time.monotonic() + _LOCK_SECONDS
    while True:
        try:
            # A lock of the process, which is not inherited by its workers and ends with it.
            fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except OSError:
            if time.monotonic() > end:
                raise ExportError(
                    str(folder), "is in use by another run of this sweep",
                    next_step="wait for it, end it, or name another folder",
                ) from None  # fmt: skip
            time.sleep(0.1)


def opened(
    folder: Path, about: Mapping[str, Any], columns: tuple[SweepColumn, ...], plan: PointPlan, *, again: bool
) -> Parts:
    """Return the parts of a sweep that goes on, or begins; points of other axes that fit are taken over.

    ``folder``: of the sweep; held by this run.
    """
    if again:
        # What a sweep has written, and nothing else.
        for name in (RESULTS_FILE, TIMINGS_FILE, ABOUT_FILE, CODE_FILE, DECK_FILE):
            (folder / name).unlink(missing_ok=True)
        for name in (PARTS_FOLDER, DECKS_FOLDER):
            shutil.rmtree(folder / name, ignore_errors=True)
    if not (folder / ABOUT_FILE).exists():
        foreign = [name for name in (RESULTS_FILE, TIMINGS_FILE, PARTS_FOLDER) if (folder / name).exists()]
        if foreign:
            raise ExportError(
                str(folder / foreign[0]), f"stands there without the {ABOUT_FILE} of its sweep",
                next_step="name another folder, or throw it away by --again (in Python again=True)",
            )  # fmt: skip
        return Parts(folder, columns)
    old = _standing(folder, about, columns)
    parts = Parts(folder, columns)
    if old[0].get("plan") != about["plan"]:
        (folder / RESULTS_FILE).unlink(missing_ok=True)
        # Until the new points are all numbered, a run of either plan has to number them by their values.
        write_text(folder / ABOUT_FILE, about_text({**old[0], "plan": ""}, old[1]))
        parts.replace_all(_adopted(folder, [c.name for c in columns if c.role == "axis"], plan))
    return parts


def _standing(
    folder: Path, about: Mapping[str, Any], columns: tuple[SweepColumn, ...]
) -> tuple[dict[str, Any], tuple[SweepColumn, ...]]:
    """Return what a folder says of its sweep, which has to be the same one."""
    try:
        old = read_about(folder)
    except MeasurementError as error:
        raise ExportError(
            error.thing, error.rule, next_step="name another folder, or throw it away by --again"
        ) from None
    _require_same(folder, old[0], about)
    if _names(old[1]) != _names(columns):
        raise _another(folder, f"its axes or answers are others: {', '.join(_names(old[1]))}")
    return old


def written_about(
    folder: Path,
    about: Mapping[str, Any],
    columns: tuple[SweepColumn, ...],
    assemblies: Mapping[str, Assembly],
) -> None:
    """Write what is asked, the decks and the digests of the code."""
    for number, (name, assembly) in enumerate(assemblies.items()):
        write_text(
            folder / DECKS_FOLDER / f"{name}.toml" if number else folder / DECK_FILE, deck_text(assembly)
        )
    write_text(folder / CODE_FILE, json.dumps(dict(code_identity().files), indent=0) + "\n")
    write_text(folder / ABOUT_FILE, about_text(about, columns))


def _names(columns: tuple[SweepColumn, ...]) -> list[str]:
    return [column.name for column in columns if column.role != "state"]


def _require_same(folder: Path, old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
    if old.get("digest") != new["digest"] or old.get("decks") != new["decks"]:
        raise _another(folder, f"its deck '{old.get('deck')}' has other numbers or parts")
    if (old.get("version"), old.get("code")) != (new["version"], new["code"]):
        was = CodeIdentity(str(old.get("version")), str(old.get("code")))
        raise _another(folder, f"it was computed by {was}, this is {code_identity()}{_changed_files(folder)}")
    if old.get("libraries") != new["libraries"]:
        raise _another(folder, f"it was computed with {_listed(old.get('libraries'))}, here are "
                               f"{_listed(new['libraries'])}")  # fmt: skip
    if old.get("asked") != new["asked"]:
        raise _another(
            folder, f"its question ({old.get('question')}) is another one, or its source was changed"
        )
    for name, given in new["contents"].items():
        before = old.get("contents", {}).get(name, {})
        changed = [text for text, digest in given.items() if before.get(text, digest) != digest]
        if changed:
            raise _another(folder, f"the files of axis {name} in {changed[0]} were others")


def _listed(libraries: Any) -> str:
    return ", ".join(f"{k} {v}" for k, v in libraries.items()) if isinstance(libraries, dict) else "others"


def _changed_files(folder: Path) -> str:
    """Return which files of the package are others than those that computed a folder."""
    try:
        old = json.loads((folder / CODE_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ""
    new = code_identity().files
    changed = sorted(name for name in {*old, *new} if old.get(name) != new.get(name))
    more = f" and {len(changed) - _SHOWN} more" if len(changed) > _SHOWN else ""
    return f"; changed: {', '.join(changed[:_SHOWN])}{more}" if changed else ""


def _another(folder: Path, why: str) -> ExportError:
    return ExportError(
        str(folder), f"holds another sweep: {why}",
        next_step="name another folder, or compute everything anew by --again (in Python again=True)",
    )  # fmt: skip


def _adopted(folder: Path, axes: list[str], plan: PointPlan) -> Iterator[Any]:
    """Yield the parts of other axes with the numbers that their points have now; -1 for those that left."""
    pyarrow, _ = libraries()
    marks = np.fromiter((_mark(values) for _, values in plan.points()), dtype=np.uint64, count=len(plan))
    order = np.argsort(marks)
    ranked = marks[order]
    for path in part_files(folder):
        table = read_columns(path)
        rows = zip(*(numpy_column(table.column(name)).tolist() for name in axes), strict=True)
        numbers = [_place(values, plan, ranked, order) for values in rows]
        place = table.schema.get_field_index("point")
        yield table.set_column(place, "point", arrow_column(numbers, pyarrow.int64())).cast(table.schema)


def _mark(values: tuple[Any, ...]) -> int:
    return int.from_bytes(hashlib.blake2b(repr(values).encode(), digest_size=8).digest(), "big")


def _place(values: tuple[Any, ...], plan: PointPlan, ranked: Any, order: Any) -> int:
    """Return the number of a point by its values; the mark only says where to look."""
    mark = np.uint64(_mark(values))
    place = int(np.searchsorted(ranked, mark))
    while place < len(ranked) and ranked[place] == mark:
        if plan.point(int(order[place])) == values:
            return int(order[place])
        place += 1
    return -1


def standing_points(
    folder: Path, about: Mapping[str, Any], columns: tuple[SweepColumn, ...], *, plan: PointPlan
) -> int:
    """Return how many points of a sweep stand in a folder; nothing is written.

    ``plan``: its points; those of other axes count that it has too.
    """
    if not (folder / ABOUT_FILE).exists():
        return 0
    old = _standing(folder, about, columns)
    if old[0].get("plan") != about["plan"]:
        names = [c.name for c in columns if c.role == "axis"]
        taken = (table.column("point").to_pylist() for table in _adopted(folder, names, plan))
        return len({number for numbers in taken for number in numbers} - {-1})
    return len(rows_in_order(folder, columns)["point"])
