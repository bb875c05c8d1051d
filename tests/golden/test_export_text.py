"""Generated text, word by word; ``NLSDESIGN_UPDATE_GOLDEN=1`` writes it anew: then read the difference."""

from __future__ import annotations

import os
import re
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlsdesign.export.c.c_text import Real
from nlsdesign.export.c.controller_code import header_text, source_text
from nlsdesign.export.c.writer import CWriter
from nlsdesign.export.fmi.fmu import fmu_texts
from nlsdesign.foundation.deck import ParentDeck
from nlsdesign.foundation.quantity import quantity
from nlsdesign.model import Plausibility
from nlsdesign.model.flat import FlatModel, Table, Variable
from nlsdesign.model.origin import Origin
from tests.hand_built import plant

STORED = Path(__file__).with_name("export")
UPDATE = os.environ.get("NLSDESIGN_UPDATE_GOLDEN") == "1"


def damper() -> FlatModel:
    """One state, one table of three points, one choice: every part of the generated text once."""
    t, x, p, w, both = *(ca.SX.sym(name) for name in "txpw"), ca.SX.sym("u", 2)
    u, valve = both[0], both[1]
    force = valve * (w * u + p * x)
    return_stroke = ca.if_else(u < 0, ca.fmin(force, 2.0), ca.exp(-u) * force)
    results = [0.5 * x + 0.25 * u, return_stroke, force**2, ca.SX(0, 1)]
    equations = ca.Function("e", [t, x, both, p, w], results)
    begin = ca.Function("begin", [x, both, p, w], [u, ca.fmin(x, u)])
    expected = ca.Function("expected", [x, both, p, w], [ca.vertcat(x, valve)])
    can = Plausibility(5.0, 0.01, 0.25, "valve.opening", 0.1)
    table = Table(
        "piston.speed", -1.0, 1.0, (Variable("viscosity", "N*s/m", "Viscosity"),), np.array([[3.0], [2], [4]])
    )
    gain = quantity(0.75, "N*s/m", source="bench 2024-05-01", spread=0.1)
    return FlatModel(
        "scheduled damper",
        "Force of a damper whose viscosity depends on speed",
        (Variable("piston.filtered", "m/s", "Filtered speed"),),
        (
            Variable("piston.speed", "m/s", "Speed", 0.0, 1.0, -1.0, 1.0, plausibility=can),
            Variable("valve.opening", "1", "Opening of the valve", 1.0, 1.0, 0.0, 1.0, largest_rate=30.0),
        ),
        (
            Variable(
                "memory.gain", "N*s/m", "Weight of the past", 0.75, 1.0, 0.0, 10.0, "bench 2024-05-01", 0.1
            ),
        ),
        (Variable("piston.force", "N", "Force", plausibility=Plausibility(noticeable=3.0)),),
        (Variable("force.squared", "N^2", "Square of the force"),),
        equations,
        0.01,
        (table,),
        begin=begin,
        expected=expected,
        origin=Origin(
            "damper", "1" * 64, ParentDeck("older_damper", "0" * 64, "diagnosed"), (), {"gain": gain}
        ),
    )


@cache
def texts() -> dict[str, str]:
    found = {
        "scheduled_damper.h": header_text(CWriter(damper(), "scheduled_damper", Real.DOUBLE)),
        "scheduled_damper.c": source_text(CWriter(damper(), "scheduled_damper", Real.DOUBLE)),
        "scheduled_damper_float.c": source_text(CWriter(damper(), "scheduled_damper", Real.FLOAT)),
    }
    for model, word in ((damper(), "damper"), (plant(), "plant")):
        for version in ("2.0", "3.0"):
            unit = fmu_texts(model, version=version, step=0.01)
            found[f"{word}_fmi{version[0]}.xml"] = unit["modelDescription.xml"].decode()
        found[f"{word}_model.c"] = unit["sources/model.c"].decode()
        found[f"{word}_index.html"] = unit["documentation/index.html"].decode()
    return {name: without_versions(text) for name, text in found.items()}


def without_versions(text: str) -> str:
    """Leave out what changes with every release: versions, and the token, which is a hash of everything."""
    text = re.sub(r"(nlsdesign|CasADi) \d+[\w.+]*", r"\1 (version)", text)
    return re.sub(r"\{[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\}", "{token}", text)


if UPDATE:
    for new, content in texts().items():
        (STORED / new).write_text(content, encoding="utf-8", newline="\n")


# The stored names, for to make the texts takes seconds; the test below compares both lists.
@pytest.mark.parametrize("name", sorted(path.name for path in STORED.iterdir()))
def test_the_generated_text_is_the_stored_one(name):
    assert texts()[name] == (STORED / name).read_text(encoding="utf-8")


def test_nothing_is_stored_that_is_no_longer_generated():
    assert {path.name for path in STORED.iterdir()} == set(texts())
