"""What differs between two recordings, and whether only a text for readers does."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

TEXTS = {".txt", ".html", ".md"}  # for readers; all else is read by machines


@dataclass(frozen=True)
class Difference:
    """One file that differs, with the first place; ``reworded`` where only a text for readers does."""

    file: str
    place: str
    reworded: bool


def compare(before: Path, after: Path) -> list[Difference]:
    """Return the differences between the jobs that were recorded in both folders."""
    both = sorted(
        done.parent.relative_to(before)
        for done in before.rglob(".done")
        if (after / done.parent.relative_to(before)).is_dir()
    )
    found = []
    for job in both:
        files = [
            {str(f.relative_to(root)) for f in (root / job).rglob("*") if f.is_file()}
            for root in (before, after)
        ]
        for name in sorted(files[0] | files[1]):
            if name.endswith("/.done") and name in files[1]:
                continue
            if name not in files[0] & files[1]:
                found.append(Difference(name, f"only {'before' if name in files[0] else 'after'}", False))
            elif (old := (before / name).read_bytes()) != (new := (after / name).read_bytes()):
                found += _differences(name, old, new)
    return found


def _differences(name: str, old: bytes, new: bytes) -> Iterator[Difference]:
    """Yield what differs in one file: at most one place that machines read, and one that readers do."""
    try:
        texts = old.decode("utf8"), new.decode("utf8")
    except UnicodeDecodeError:
        digests = [hashlib.sha256(data).hexdigest()[:12] for data in (old, new)]
        yield Difference(name, f"bytes: {digests[0]} -> {digests[1]}", False)
        return
    suffix = Path(name).suffix
    places: list[tuple[str, bool]] = []
    if suffix == ".json":
        with suppress(json.JSONDecodeError):
            places += _places(json.loads(texts[0]), json.loads(texts[1]), "")
    for reworded in (False, True):
        of_kind = [place for place, is_text in places if is_text == reworded]
        if of_kind:
            yield Difference(name, f"{of_kind[0]}   ({len(of_kind)} places)", reworded)
    if not places:  # also JSON whose values are the same, but not the order of its keys or its layout
        lines = [text.splitlines() for text in texts]
        number, a, b = next(
            ((i, a, b) for i, (a, b) in enumerate(zip(*lines, strict=False)) if a != b),
            (min(map(len, lines)), "", "one of them goes on, or has other ends of lines"),
        )
        note = " (its numbers differ too)" if suffix in TEXTS and _numbers(*texts) else ""
        yield Difference(name, f"line {number + 1}{note}\n    - {a[:200]}\n    + {b[:200]}", suffix in TEXTS)


def _numbers(old: str, new: str) -> bool:
    """Whether the numbers in two texts differ."""
    return len({tuple(re.findall(r"\d+(?:\.\d+)?", text)) for text in (old, new)}) > 1


def _places(old: Any, new: Any, path: str) -> Iterator[tuple[str, bool]]:
    """Yield the places at which two JSON values differ, and whether only the words of a sentence do."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [*old, *(key for key in new if key not in old)]:
            if key in old and key in new:
                yield from _places(old[key], new[key], f"{path}/{key}")
            else:
                yield f"{path}/{key}: only {'before' if key in old else 'after'}", False
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, pair in enumerate(zip(old, new, strict=True)):
            yield from _places(*pair, f"{path}[{index}]")
    elif repr(old) != repr(new):
        texts = all(
            isinstance(each, str) and "\n" not in each and len(each.split()) > 3 for each in (old, new)
        )
        yield f"{path}: {str(old)[:100]} -> {str(new)[:100]}", texts and not _numbers(old, new)


def show(before: Path, after: Path) -> int:
    """Print what differs; 1 if it is more than texts, or if there is nothing to compare."""
    found = compare(before, after)
    recorded = [{done.parent.relative_to(root) for done in root.rglob(".done")} for root in (before, after)]
    for title, reworded in (("Texts that were reworded", True), ("Different", False)):
        of_kind = [each for each in found if each.reworded == reworded]
        print(f"{title}: {len(of_kind)}")
        for each in of_kind:
            print(f"  {each.file}: {each.place}")
    for folder, missing in ((after, recorded[0] - recorded[1]), (before, recorded[1] - recorded[0])):
        if missing:
            print(f"{len(missing)} jobs are not in {folder}: {', '.join(map(str, sorted(missing)[:6]))}, ...")
    print(f"{len(recorded[0] & recorded[1])} jobs compared")
    return int(not recorded[0] & recorded[1] or any(not each.reworded for each in found))
