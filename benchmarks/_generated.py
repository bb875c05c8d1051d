"""Every kind of code that is generated for a controller, as one step that can be measured."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import nlsdesign as nls
from nlsdesign.components import Assembly, QuadraticDrag, TorqueRipple, smoothed, tie
from nlsdesign.export import CSource, export_c, export_watch, write_examples
from nlsdesign.feedback.control import joined
from nlsdesign.feedback.observer.spread.choice import designed_observer
from nlsdesign.model import FlatModel
from nlsdesign.regeneration import watch_plan
from tests.compiling import compile_program
from tests.watching import as_step, quick

DECK = "austin2015_figure_consistent"
SUPERVISED, MONITOR = "cascade observer and scheduled controller, supervised", "monitor"
_SUPERVISED_HEADER = """#include "step.h"
#include "step_supervisor.h"
typedef struct { step_state step; step_supervisor supervisor; } supervised_state;
typedef step_inputs supervised_inputs;
typedef step_outputs supervised_outputs;
typedef step_parameters supervised_parameters;
uint32_t supervised_init(supervised_state *state, const supervised_parameters *parameters);
uint32_t supervised_set_parameters(supervised_state *state, const supervised_parameters *parameters);
uint32_t supervised_step(supervised_state *state, const supervised_inputs *inputs, supervised_outputs *out);
void supervised_defaults(supervised_parameters *parameters);
#define states step.states
"""
_SUPERVISED = """#include "step.c"
#include "supervised.h"
uint32_t supervised_init(supervised_state *state, const supervised_parameters *parameters)
{
    *state = (supervised_state){0};
    return step_init(&state->step, parameters);
}
uint32_t supervised_set_parameters(supervised_state *state, const supervised_parameters *parameters)
{
    return step_set_parameters(&state->step, parameters);
}
void supervised_defaults(supervised_parameters *parameters)
{
    step_defaults(parameters);
}
uint32_t supervised_step(supervised_state *state, const supervised_inputs *inputs, supervised_outputs *out)
{
    const uint32_t status = step_step(&state->step, inputs, out);
    out->motor.current *= (@real@)step_supervise(&state->supervisor, status);
    return status;
}
"""


def machine() -> FlatModel:
    """Return the bundled machine."""
    return nls.flatten(nls.declare(nls.load_deck(DECK)))


def with_known_effects() -> Assembly:
    """Return the machine with ripple and drag of the motor, as a diagnosis adds them."""
    return (
        nls.declare(nls.load_deck(DECK))
        .with_part("ripple", tie(TorqueRipple(sine=0.05, cosine=0.02, order=24.0), "motor"))
        .with_part("drag", tie(QuadraticDrag(drag=1e-5), "motor"))
    )


def models() -> dict[str, FlatModel]:
    """Return what observers and controllers compute, from the bundled deck."""
    plant = machine()
    observers = {
        f"{kind} observer": designed_observer(plant, kind=kind).model
        for kind in ("cascade", "certified", "kalman", "published", "corrected")
    }
    controllers = {
        "controller": nls.torque_controller(plant, law=nls.control.PidTorque()),
        "scheduled controller": nls.torque_controller(plant, law=nls.control.ScheduledTorque()),
        "scheduled controller, ripple and drag compensated": nls.torque_controller(
            nls.flatten(with_known_effects()), law=nls.control.ScheduledTorque()
        ),
    }
    both = {
        f"{name} observer and {which}": joined(observers[f"{name} observer"], controllers[which])
        for name in ("cascade", "corrected")
        for which in ("controller", "scheduled controller")
    }
    return observers | controllers | both


def supervised(model: FlatModel, folder: Path, real: str) -> CSource:
    """Write a joined step whose current is what its supervisor lets act."""
    source = export_c(model, folder, real=real, name="step")
    write_examples(source)
    files = {"supervised.h": _SUPERVISED_HEADER, "supervised.c": _SUPERVISED}
    for name, text in files.items():
        (folder / name).write_text(text.replace("@real@", real), encoding="utf-8")
    return replace(source, name="supervised", header=folder / "supervised.h", source=folder / "supervised.c")


def written(name: str, model: FlatModel, folder: Path, real: str, *, quick_monitor: bool = True) -> CSource:
    """Write the files of a kind; a quick monitor judges within the vectors of a self-test."""
    if name == MONITOR:
        plan = quick(monitor_plan()) if quick_monitor else monitor_plan()
        return as_step(export_watch(plan, folder, real=real))
    if name == SUPERVISED:
        return supervised(model, folder, real)
    return export_c(model, folder, real=real, name="step")


def generated_files(source: CSource) -> list[Path]:
    """Return the C that a user compiles, without what makes one step of it here."""
    own = {"watched": ["watch.c", "watch_residuals.c"], "supervised": ["step.c"]}.get(source.name)
    return [source.header.parent / name for name in own] if own else [source.source]


def self_test_passes(source: CSource) -> bool:
    """Compile and run the self-test that was written beside the code."""
    files = [source.selftest, *generated_files(source)]
    program = compile_program(files, source.selftest.parent / "self_test", flags=["-std=c99"])
    return subprocess.run([program], check=False, capture_output=True).returncode == 0


def monitor_plan() -> nls.export.WatchPlan:
    """Return what the monitor of the bundled machine computes."""
    return watch_plan(nls.flatten(smoothed(nls.declare(nls.load_deck(DECK)))), 1e-3)


def every_kind() -> dict[str, FlatModel]:
    """Return all kinds: observers, controllers, both as one step, with a supervisor, and the monitor."""
    chosen = models()
    joint = chosen["cascade observer and scheduled controller"]
    return chosen | {SUPERVISED: joint, MONITOR: monitor_plan().model}
