"""Commands of our own, through the front door: what no command of nlsdesign writes to the last digit."""

from __future__ import annotations

import csv
import datetime
import json
import os
import random
import runpy
import sys
from pathlib import Path
from typing import Any


def flat(deck: str, model: str = "") -> None:
    """Write what a flat model says of itself, its numbers at pseudo-random points, and its deck."""
    import nlsdesign as nls

    loaded = nls.load_deck(deck)
    assembly = getattr(nls.models, model)(loaded) if model else nls.declare(loaded)
    nls.write_deck(assembly, Path("written.toml"))
    flattened, drawn = nls.flatten(assembly), random.Random(0)
    groups = ("states", "inputs", "parameters", "outputs", "signals")
    shown = ("name", "unit", "description", "start", "nominal", "minimum", "maximum", "source", "spread")
    told: dict[str, Any] = {
        group: [{key: getattr(each, key) for key in shown} for each in getattr(flattened, group)]
        for group in groups
    }
    told |= {"name": flattened.name, "description": flattened.description, "points": []}
    for _ in range(3):
        state, inputs = (
            [each.start + each.nominal * drawn.uniform(-0.5, 0.5) for each in group]
            for group in (flattened.states, flattened.inputs)
        )
        values = flattened.evaluate(state, inputs, time=0.1)
        try:
            slopes = {
                name: matrix.tolist()
                for name, matrix in zip("ABCD", nls.linearise(flattened, state, inputs), strict=False)
            }
        except nls.errors.NlsError as error:
            slopes = {"none": str(error)}
        told["points"].append({"state": state, "inputs": inputs, "values": values, "slopes": slopes})
    Path("flat.json").write_text(json.dumps(told, indent=1, ensure_ascii=False, default=str), encoding="utf8")


def views(deck: str) -> None:
    """Write the views over the angle to the last digit."""
    import nlsdesign as nls

    model = nls.flatten(nls.declare(nls.load_deck(deck)), outputs=["motor.angle", "spring.torque"])
    asked = [nls.Observability(), nls.Stability(), nls.EstimateDeviation()]
    chart = nls.over_angle(model, asked, angles=[0.1, 0.3, 0.5, 0.7])
    columns = [{"name": c.name, "unit": c.unit, "values": chart[c.name].tolist()} for c in chart.columns]
    told = {"columns": columns, "words": {name: list(texts) for name, texts in chart.words.items()}}
    text = json.dumps(told, indent=1, ensure_ascii=False)
    Path("views.json").write_text(text, encoding="utf8")


def table(folder: str) -> None:
    """Write the table of a sweep to the last digit."""
    import nlsdesign as nls

    columns = nls.read_sweep(folder).values
    with Path("table.csv").open("w", encoding="utf8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def at_fixed_time(*words: str) -> None:
    """Run a command at the time of ``SOURCE_DATE_EPOCH``: the name of a fitted deck depends on the day."""

    class Fixed(datetime.datetime):
        @classmethod
        def now(cls, tz: datetime.tzinfo | None = None) -> Fixed:
            return cls.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), tz)

    datetime.datetime = Fixed  # type: ignore[misc]
    sys.argv = ["nlsdesign", *words]
    runpy.run_module("nlsdesign", run_name="__main__", alter_sys=True)


OWN = {"flat": flat, "views": views, "table": table, "at_fixed_time": at_fixed_time}
