"""Live design: how long an edit takes, over several hundred drags of several decks, in one thread.

    python benchmarks/live.py [--drags 100]

A drag moves a random point of the target by steps of about 2 % of its torque and a tenth of its room, every
tenth one a limit by 2 %. Counted is everything between the edit and its answer as JSON. Wall time and time of
the processor are both given: on a machine that other work shares they differ.
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np

from nlsdesign.foundation.errors import NlsError
from nlsdesign.live.answers import to_json
from nlsdesign.live.edits import LiveEdit, change_limit, edit, move_point
from nlsdesign.live.gallery import gallery_question
from nlsdesign.live.live_design import LiveDesign

DECKS = (
    "cam-actuator",
    "one-sided-finger",
    "one_sided_cable_drive",
    "austin2015_figure_consistent",
    "test_rig",
)
_LENGTH = 10
"""Steps of one drag, all in one direction."""


def edits(live: LiveDesign, draw: np.random.Generator) -> list[LiveEdit]:
    """One drag: steps in one direction."""
    question = live.question
    limits = list(question.limit_values.values())
    if limits and draw.uniform() < 0.1:
        limit = limits[int(draw.integers(len(limits)))]
        factor = 1.02 if draw.uniform() < 0.5 else 0.98
        return [edit(change_limit, limit.kind.name, limit.value * factor ** (k + 1)) for k in range(_LENGTH)]
    points = question.points
    index = int(draw.integers(1, len(points)))
    room = points[index].angle - points[index - 1].angle
    step, sideways = 0.02 * draw.choice([-1.0, 1.0]), 0.1 * room * draw.uniform(-1.0, 1.0) / _LENGTH
    angle, torque = points[index]
    return [
        edit(move_point, index, angle + sideways * (k + 1), torque * (1.0 + step) ** (k + 1))
        for k in range(_LENGTH)
    ]


def measured(deck: str, drags: int) -> tuple[list[float], list[float], dict[str, int]]:
    """Wall times and processor times of all steps in s, and how often each state was answered."""
    live, draw = LiveDesign(gallery_question(deck)), np.random.default_rng(0)
    wall: list[float] = []
    processor: list[float] = []
    states: dict[str, int] = {}
    while len(wall) < drags:
        for step in edits(live, draw):
            begin, used = time.perf_counter(), time.process_time()
            try:
                answer = live.apply(step, drag="benchmark")
            except NlsError:
                break
            json.dumps(to_json(answer))
            wall.append(time.perf_counter() - begin)
            processor.append(time.process_time() - used)
            states[answer.state] = states.get(answer.state, 0) + 1
    return wall, processor, states


def row(what: str, seconds: list[float]) -> str:
    """Median, 95 % and worst in ms, and the share within 100 ms."""
    ms = 1e3 * np.array(seconds)
    inside = 100.0 * float(np.mean(ms <= 100.0))
    return (
        f"{what:>38}  median {np.median(ms):6.1f} ms   95 % {np.quantile(ms, 0.95):6.1f} ms   "
        f"worst {ms.max():7.1f} ms   within 100 ms {inside:5.1f} %"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--drags", type=int, default=100, help="Steps for each deck.")
    count = parser.parse_args().drags
    all_wall: list[float] = []
    all_processor: list[float] = []
    for deck in DECKS:
        wall, processor, states = measured(deck, count)
        print(row(f"{deck}, wall", wall))
        print(row("processor", processor), states)
        all_wall += wall
        all_processor += processor
    print(row(f"all {len(all_wall)} steps, wall", all_wall))
    print(row("processor", all_processor))


if __name__ == "__main__":
    main()
