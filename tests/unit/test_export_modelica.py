"""Models as Modelica text: an independent parser reads the same equations, and what cannot be said is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.deck import deck_names, load_deck
from nlsdesign.export import export_modelica
from nlsdesign.export.modelica.modelica_model import modelica_text
from nlsdesign.model import FlatModel, flatten


def deck(name: str) -> FlatModel:
    return flatten(declare(load_deck(name)))


LARGE = {"austin2015_as_printed", "austin2015_figure_consistent", "one_sided_cable_drive", "test_rig"}


@pytest.mark.parametrize("name", sorted(deck_names()))
def test_an_independent_compiler_reads_the_same_equations(name: str) -> None:
    reading = pytest.importorskip("tests.modelica_reading", reason="pymoca is not installed")
    model = deck(name)
    read = reading.ReadModel(modelica_text(model))
    generator = np.random.default_rng(1)
    for _ in range(5):
        x = [generator.normal(v.start, 0.3 * v.nominal) for v in model.states]
        u = [generator.normal(v.start, 0.5 * v.nominal) for v in model.inputs]
        p = [v.start * generator.uniform(0.97, 1.03) for v in model.parameters]
        time = generator.uniform(0.0, 5.0)
        f, y, s, _ = (np.array(each).ravel() for each in model.equations(time, x, u, p, []))
        rates = {f"der({v.name})": value for v, value in zip(model.states, f, strict=True)}
        expected = rates | {v.name: value for v, value in zip((*model.outputs, *model.signals), (*y, *s), strict=True)}
        got = read.values(time, x, u, p)
        for k, e in expected.items():
            if k in got:
                assert got[k] == pytest.approx(e, rel=1e-12, abs=1e-30), k
