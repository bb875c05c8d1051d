"""One machine under code from three decks: what it costs to leave a better deck unused.

The machine is the actuator as the diagnosis left it, the best that is known of the one that was measured.
Observer and controller are those that were generated from the published deck, from the designed one, whose
spring the machine does not have, and from the diagnosed deck itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

import nlsdesign as nls
from nlsdesign.bench.identification import rmse
from nlsdesign.feedback.control import ScheduledTorque
from nlsdesign.feedback.observer import choose_observer
from nlsdesign.foundation.work_sharing import parallel_map

from .torque_loop import FROM_ENCODER, TorqueLoop, export_and_cosimulate

AMPLITUDE, FREQUENCY = 2.0, 1.0  # N·m, Hz; slow enough for the second relaxation to show
CYCLES, FEWER = 8, 5  # the fewer without an observer that learns
_REPEATS = 0.05
"""Largest change of the torque error from one cycle to the next with which a run counts as settled."""


class Code(NamedTuple):
    """Plant of one deck, and two observers of it: the cascade, and the best over the spread of the deck."""

    plant: nls.FlatModel
    cascade: nls.FlatModel
    best: nls.FlatModel


@dataclass(frozen=True, eq=False)
class UnderCode:
    """The machine under code from one deck.

    Parameters
    ----------
    origin
        The deck that the code is from.
    torque_error
        Root mean square of the spring's less the wanted torque over the last cycle, in N·m; not a number
        where the error of the cycle before differs by more than a twentieth.
    estimate_error
        Root mean square of the estimated less the spring's torque over that cycle, in N·m, likewise.
    peak_current
        In A, over that cycle.
    run
        The whole run.
    """

    origin: nls.model.Origin
    torque_error: float
    estimate_error: float
    peak_current: float
    run: nls.Trace

    @property
    def settled(self) -> bool:
        """Whether the error repeats itself."""
        return math.isfinite(self.torque_error)


@dataclass(frozen=True, eq=False)
class GeneratedCode:
    """The diagnosed actuator under code from three decks.

    Parameters
    ----------
    model
        The diagnosed actuator.
    loop
        Code and FMUs generated from it, with the cascade as observer, and their co-simulation.
    under
        By name of the deck that the code is from, and kind of its observer.
    """

    model: nls.FlatModel
    loop: TorqueLoop
    under: Mapping[tuple[str, str], UnderCode]

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers; none of a run that does not settle."""
        numbers = {f"diagnosed_{what}": number for what, number in self.loop.numbers.items()}
        for (deck, kind), each in self.under.items():
            if each.settled:
                code = f"code_from_{deck}_deck_{kind}"
                numbers[f"{code}_torque_error_mNm_rms"] = 1e3 * each.torque_error
                numbers[f"{code}_estimate_error_mNm_rms"] = 1e3 * each.estimate_error
        return numbers


def code_of_three_decks(
    better: nls.Assembly,
    others: Mapping[str, Code],
    out: Path,
    *,
    fast: bool,
) -> GeneratedCode:
    """Export the diagnosed actuator, and run it under the code of each deck; the fast way, the cascades."""
    model = nls.flatten(better, outputs=["motor.angle", "motor_encoder.reading", "spring.torque"])
    # Records know its numbers far better than the spreads in the deck say: the cascade takes them as exact.
    cascade = nls.observer.design_observer_with_details(model).model
    loop = export_and_cosimulate(model, cascade, out, None if fast else 3.0)
    best = cascade if fast else choose_observer(model).model
    decks = {**others, "diagnosed": Code(model, cascade, best)}
    kinds, cycles = (("cascade",), FEWER) if fast else (("cascade", "best"), CYCLES)
    pairs = [(deck, kind) for deck in decks for kind in kinds]
    runs = parallel_map(
        lambda k: _under(model, decks[pairs[k][0]], kind=pairs[k][1], cycles=cycles), len(pairs)
    )
    return GeneratedCode(model, loop, dict(zip(pairs, runs, strict=True)))


def _under(machine: nls.FlatModel, code: Code, *, kind: str, cycles: int) -> UnderCode:
    """Run the machine under the controller and one observer made for a plant."""
    controller = nls.torque_controller(code.plant, law=ScheduledTorque())
    observer = code.best if kind == "best" else code.cascade
    assert controller.origin is not None
    assert observer.origin is not None
    assert controller.origin.digest == observer.origin.digest
    loop = nls.ClosedLoop(plant=machine, observer=observer, controller=controller, wires=FROM_ENCODER)
    run = loop.run(cycles / FREQUENCY, inputs=nls.sine(loop.desired, AMPLITUDE, FREQUENCY))
    number = np.floor(run.time * FREQUENCY)
    before, last = (number == cycle for cycle in (cycles - 2, cycles - 1))
    errors = [rmse(run[loop.torque][rows] - run[loop.desired][rows]) for rows in (before, last)]
    estimated = rmse(run[loop.estimate][last] - run[loop.torque][last])
    if not abs(errors[1] - errors[0]) <= _REPEATS * errors[1]:
        errors[1] = estimated = math.nan
    peak = float(np.max(np.abs(run["plant.motor.current"][last])))
    return UnderCode(controller.origin, errors[1], estimated, peak, run)
