"""Tables of sweeps that no run has made: small, of known answers, with names that nobody means well with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nlsdesign.components.assembly.deck_writer import deck_text, declare
from nlsdesign.foundation.deck import load_deck
from nlsdesign.sweeps.sweep_columns import STATE_COLUMNS, SweepColumn
from nlsdesign.sweeps.sweep_table import SweepTable

DECK = "austin2015_as_printed"
AREA, INERTIA, RUBBER = "spring.rubber.area", "motor.inertia", "spring.rubber"
HOSTILE = '<script>document.title="broken"</script>, "a" & $x^2$ </script> Ω\x1b[31m'


def table_of(
    axes: Mapping[str, Any],
    answers: Mapping[str, Any],
    *,
    failed: Sequence[int] = (),
    kind: str = "random",
    reason: str = "limits: contradict each other",
    about: Mapping[str, Any] | None = None,
) -> SweepTable:
    """Return a table; answers of failed points are removed."""
    count = len(next(iter(axes.values())))
    done = np.ones(count, dtype=bool)
    done[list(failed)] = False
    columns, values = [STATE_COLUMNS[0]], {"point": np.arange(count)}
    units = {AREA: "m^2", INERTIA: "kg*m^2"}
    for name, given in axes.items():
        words = np.asarray(given).dtype.kind not in "fiub"
        values[name] = np.asarray(given, dtype=object if words else float)
        ends = (None, None) if words else (float(np.min(values[name], initial=1.0)), 2.0)
        columns.append(
            SweepColumn(name, units.get(name, ""), "of the part", "axis", "list" if words else kind, *ends)
        )
    for name, given in answers.items():
        values[name] = np.where(done, np.asarray(given, dtype=float), np.nan)
        columns.append(SweepColumn(name, "N*m", "an answer", "answer"))
    values["status"] = np.where(done, "done", "failed").astype(object)
    values["reason"] = np.where(done, "", reason).astype(object)
    return SweepTable(
        (*columns, *STATE_COLUMNS[1:]), values,
        about or {"deck": DECK, "digest": "0" * 64, "version": "0", "seed": 0, "points": count},
        {DECK: deck_text(declare(load_deck(DECK)))},
    )  # fmt: skip


def spread_table(count: int = 60, *, seed: int = 1, **more: Any) -> SweepTable:
    """Two numbers and a rubber of a real deck, two answers that contradict each other."""
    random = np.random.default_rng(seed)
    area, inertia = random.uniform(5e-5, 2e-4, count), random.uniform(1e-6, 9e-6, count)
    rubber = np.array(["Dragon_Skin_30", "PMC-770"], dtype=object)[random.integers(2, size=count)]
    answers = {"error": area * 1e4 + inertia * 4e5, "mass": 1e-4 / area + inertia * 4e5}
    return table_of({AREA: area, INERTIA: inertia, RUBBER: rubber}, answers, **more)
