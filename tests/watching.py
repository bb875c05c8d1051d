"""A monitor as one step, so that what measures a controller measures it too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from nlsdesign.export import CSource, WatchPlan
from nlsdesign.export.c.watch_code import LENGTH, WatchSource
from nlsdesign.foundation.arrays import Array

HEADER = """#ifndef WATCHED_H
#define WATCHED_H
#include "{name}.h"
typedef {name}_state watched_state;
typedef {name}_residuals_inputs watched_inputs;
typedef {name}_residuals_outputs watched_outputs;
typedef {name}_residuals_parameters watched_parameters;
typedef {name}_residuals_states watched_states;
uint32_t watched_init(watched_state *state, const watched_parameters *parameters);
uint32_t watched_set_parameters(watched_state *state, const watched_parameters *parameters);
uint32_t watched_step(watched_state *state, const watched_inputs *inputs, watched_outputs *outputs);
void watched_defaults(watched_parameters *parameters);
#define states residuals.states
#endif
"""
SOURCE = """#include "{name}_residuals.c"
#include "{name}.c"
#include "watched.h"
uint32_t watched_init(watched_state *state, const watched_parameters *parameters)
{{
    (void)parameters;
    {name}_init(state);
    return 0u;
}}
void watched_defaults(watched_parameters *parameters)
{{
    *parameters = (watched_parameters){{0}};
}}
uint32_t watched_set_parameters(watched_state *state, const watched_parameters *parameters)
{{
    (void)state;
    (void)parameters;
    return 0u;
}}
uint32_t watched_step(watched_state *state, const watched_inputs *inputs, watched_outputs *outputs)
{{
    const uint32_t word = {name}_step(state, inputs, 0);
    *outputs = state->residuals.outputs;
    return word;
}}
"""


def as_step(source: WatchSource) -> CSource:
    """Write header and source of a step that is the monitor; its status word is the monitor's."""
    folder = source.header.parent
    files = {"watched.h": HEADER, "watched.c": SOURCE}
    for file, text in files.items():
        (folder / file).write_text(text.format(name=source.name), encoding="utf-8")
    header, code = (Path(folder) / file for file in files)
    return CSource("watched", source.plan.model, source.real, header, code, source.selftest)


def quick(plan: WatchPlan) -> WatchPlan:
    """Return a monitor that judges every five means, and at once."""
    return replace(
        plan,
        between=5.0 * LENGTH * plan.model.sample_time,
        settling=plan.model.sample_time,
        least=4.0,
        some=0.0,
    )


def readings(plan: WatchPlan, count: int) -> Array:
    """Return angles that swing, a current that goes with them, and two samples that are no number."""
    time = np.arange(count) * plan.model.sample_time
    swing = 0.5 * np.sin(9.0 * time) + 0.1 * np.sin(31.0 * time)
    columns = {
        "motor.current": 3.0 * swing,
        "ammeter.reading": 0.6 * swing,
        "load_encoder.reading": 0.95 * swing,
    }
    table = np.column_stack([columns.get(v.name, swing) for v in plan.model.inputs]).astype(np.float32)
    table[count // 2 : count // 2 + 2, 0] = np.nan
    return table.astype(float)
