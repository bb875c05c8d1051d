"""``documentation/origin.json`` of an FMU: its deck with all numbers, and a digest of every other file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from ...foundation.deck import ParentDeck
from ...foundation.locations import version
from ...model.flat import FlatModel
from ...model.origin import Origin

ORIGIN_FILE = "documentation/origin.json"
ORIGIN_FORMAT = "nlsdesign origin 1"


def with_origin(model: FlatModel, contents: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the contents of an FMU with one file more, which says where they come from."""
    record = {
        "format": ORIGIN_FORMAT,
        "generator": f"nlsdesign {version()}",
        "model": model.name,
        "deck": _deck(model.origin) if model.origin else None,
        "files": {path: hashlib.sha256(contents[path]).hexdigest() for path in sorted(contents)},
    }
    text = json.dumps(record, indent=1, ensure_ascii=False) + "\n"
    return {**contents, ORIGIN_FILE: text.encode()}


def _deck(origin: Origin) -> dict[str, Any]:
    return {
        "name": origin.deck,
        "sha256": origin.digest,
        "changed": list(origin.changed),
        "parent": _parent(origin.parent),
        "numbers": {
            name: {"value": q.shown, "unit": q.unit, "source": q.source, "spread": q.spread}
            for name, q in origin.numbers.items()
        },
    }


def _parent(parent: ParentDeck | None) -> dict[str, Any] | None:
    if parent is None:
        return None
    words = {"name": parent.name, "sha256": parent.digest, "change": parent.change}
    return {**words, "parent": _parent(parent.parent)}
