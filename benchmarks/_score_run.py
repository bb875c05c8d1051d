"""One case: make records, let each method decide on the files alone, then compare with what was hidden."""

from __future__ import annotations

import os
import signal
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

from benchmarks._score_cases import Case
from benchmarks._score_yardsticks import YARDSTICKS, MissingError, table_of
from models.test_rig import test_rig_deck
from nlsdesign.components import Assembly
from nlsdesign.discrepancy import Verdict, diagnose
from nlsdesign.identification import RecordSet, load_records
from nlsdesign.model import flatten
from tests.rig import ACTUATORS, Hidden, make_records, truth, write_set

TRUE_SIZES: dict[str, tuple[str, Callable[[Hidden], float]]] = {
    "coulomb_friction": ("sliding_effort", lambda h: h.friction),
    "load_dependent_friction": ("ratio", lambda h: h.load_friction),
    "quadratic_drag": ("drag", lambda h: h.drag),
    "torque_ripple": ("order", lambda h: h.ripple_order),
    "backlash": ("gap", lambda h: h.gap),
    "drive_delay": ("delay", lambda h: h.drive_delay),
    "cable_compliance": ("stiffness", lambda h: h.cable_stiffness),
    "cable_slack": ("length", lambda h: h.slack),
    "cam_angle_offset": ("offset", lambda h: h.cam_offset),
    "second_relaxation": ("modulus", lambda h: h.branch_modulus),
    "current_sensor_bias": ("bias", lambda h: h.current_bias),
    "force_sensor_bias": ("bias", lambda h: h.force_bias),
    "force_sensor_gain": ("gain", lambda h: h.force_gain),
    "force_sensor_delay": ("delay", lambda h: h.force_delay),
}
"""Numbers that mean the same in the package and in the rig: only these have a true value."""
_INTERVAL = 1.96


class TooLongError(Exception):
    """A case took longer than it may."""


def run(case: Case, limit: int, yardsticks: bool) -> dict[str, Any]:
    """Return the result of one case; one that fails gives the reason.

    Parameters
    ----------
    case
        What to hide.
    limit
        Seconds after which it is given up; 0 for never.
    yardsticks
        Whether the yardsticks decide on the same records.
    """
    result: dict[str, Any] = {
        "case": case.name, "kind": case.kind, "actuator": case.actuator, "hidden": list(case.effects),
        "strength": case.strength, "seed": case.seed,
    }  # fmt: skip
    if limit:
        signal.signal(signal.SIGALRM, _give_up)
        signal.alarm(limit)
    begin, worked = time.perf_counter(), _worked()
    try:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            actuator = ACTUATORS[case.actuator]
            write_set(folder, actuator, make_records(actuator, case.hidden, case.seed))
            begin, worked = time.perf_counter(), _worked()
            declared, records = opened(folder)
            verdict = diagnose(declared, records)
            result["seconds"] = time.perf_counter() - begin
            result["cpu_seconds"] = _worked() - worked
            result |= _said(verdict)
            result["covered"] = _covered(case, verdict)
            result["yardsticks"] = _yardsticks(declared, records) if yardsticks else {}
    except Exception as error:
        result["seconds"] = time.perf_counter() - begin
        result["cpu_seconds"] = _worked() - worked
        result["error"] = f"{type(error).__name__}: {error}"
        result["trace"] = traceback.format_exc(limit=-4)
    finally:
        if limit:
            signal.alarm(0)
    return result


def _worked() -> float:
    """Return the processor time of this process and of those that it has waited for."""
    return sum(os.times()[:4])


def _give_up(number: int, frame: FrameType | None) -> None:
    raise TooLongError("longer than the limit")


def opened(folder: Path) -> tuple[Assembly, RecordSet]:
    """Return what a folder declares and the records in it; that is all that a method gets to see.

    Parameters
    ----------
    folder
        With ``rig.toml``, ``cam.csv`` and the records.
    """
    declared = test_rig_deck(folder / "rig.toml", folder / "cam.csv")
    return declared, load_records(folder, flatten(declared))


def _said(verdict: Verdict) -> dict[str, Any]:
    return {
        "verdict": verdict.verdict,
        "named": [effect.name for effect in verdict.effects],
        "aliases": [list(effect.aliases) for effect in verdict.effects],
        "closed": verdict.closed,
        "ratio": verdict.held_out_ratio,
        "where": list(verdict.where),
        "runners_up": [[name, round(share, 3)] for name, share in verdict.runners_up],
    }


def _covered(case: Case, verdict: Verdict) -> dict[str, list[Any]]:
    """Return for each effect named rightly: value, standard error, truth, whether the interval holds it."""
    hidden = truth(ACTUATORS[case.actuator], case.hidden, case.seed)[1]
    found = {}
    for effect in verdict.effects:
        if effect.name in case.effects and effect.name in TRUE_SIZES:
            last, size_of = TRUE_SIZES[effect.name]
            own = [(v, s) for n, (v, _, s) in effect.parameters.items() if n.endswith(f".{last}")]
            if own:
                (value, error), true = own[0], size_of(hidden)
                found[effect.name] = [value, error, true, bool(abs(value - true) <= _INTERVAL * error)]
    return found


def _yardsticks(declared: Assembly, records: RecordSet) -> dict[str, list[str] | str]:
    found: dict[str, list[str] | str] = {}
    table = table_of(declared, records)
    for name, decide in YARDSTICKS.items():
        try:
            found[name] = decide(table)
        except MissingError as error:
            found[name] = f"skipped: {error}"
    return found
