"""A monitor as one step, so that what measures a controller measures it too."""

from __future__ import annotations

from pathlib import Path

from nlsdesign.export import CSource
from nlsdesign.export.c.watch_code import WatchSource

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
