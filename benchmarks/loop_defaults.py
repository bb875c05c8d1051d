"""Torque laws side by side: the default, a PID with the gain that the spring allows, and Kp 32.

``python -m benchmarks.loop_defaults`` closes the loop of each actuator with the cascade observer, 1 kHz, one
sample of delay and the counts of its encoder, and asks for sines at 2 and 5 Hz of half the torque that the
drive can hold. The numbers of the plant are drawn from the spreads of the deck; observer and controller keep
those of the deck. The actuators are the bundled decks with a torque loop and the actuator that the study
``austin2015`` designs. No setting of a law was chosen with these draws.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator

import numpy as np

import nlsdesign as nls
from benchmarks.observer_defaults import actuators
from nlsdesign.export import quickest
from nlsdesign.feedback.control import REPRODUCED_GAINS, PidTorque, loop_over_spread
from nlsdesign.feedback.control.evaluation.spread_margins import margins_alone
from nlsdesign.feedback.control.evaluation.whole_evaluation import cascade_loops
from nlsdesign.regeneration import usual_last

FREQUENCIES = (2.0, 5.0)
SHARE = 0.5
"""Amplitude over the torque that the drive can hold."""
DECKS = ("austin2015_as_printed", "austin2015_soft_spring", "austin2015_stiff_spring", "test_rig")
LAWS = {
    "default": {},
    "PID, gain by spring": {"law": PidTorque()},
    "PID, Kp 32": {"gains": REPRODUCED_GAINS},
}


def rows(plant: nls.FlatModel, draws: int, seed: int) -> Iterator[str]:
    """Yield a row for each law and frequency."""
    amplitude = SHARE * nls.control.largest_torque(plant)
    size = 1e3 * amplitude / math.sqrt(2.0)
    for name, law in LAWS.items():
        loop, _ = cascade_loops(plant, plant, delay=1, sample_time=1e-3, **law)
        gain = "controller.proportional"
        gain = gain if gain in loop.controller.values else "controller.bandwidth"
        margins = margins_alone(loop, gain, last=usual_last(plant))
        (db, degrees) = margins.spread
        has = f"{db:.2g} dB, {degrees:.2g}°" if math.isfinite(db) else "unstable"
        for frequency in FREQUENCIES:
            run = loop.run(2.0, inputs=nls.sine(loop.desired, amplitude, frequency))
            error = (run[loop.torque] - run[loop.desired])[run.time >= 1.0]
            exact = 1e3 * float(np.sqrt(np.mean(error**2)))
            spread = loop_over_spread(
                loop, amplitude=amplitude, frequency=frequency, draws=draws, seed=seed, translate=quickest()
            )
            yield (
                f"{amplitude:.3g} N·m, {frequency:g} Hz | {name} | {exact:.3g} | "
                f"{size * spread.quantile(0.5):.3g} | {size * spread.quantile(0.9):.3g} | "
                f"{100 * spread.held:.0f} % | {has}"
            )


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--seed", type=int, default=2027)
    given = parser.parse_args()
    machines = actuators() | {name: nls.declare(nls.load_deck(name)) for name in DECKS}
    print("torque error in mN·m rms; margins that 95 % of the machines of the spread keep")
    print("| actuator | sine | law | exact deck | spread, median | spread, 90 % | settle | margins |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |", flush=True)
    for title, actuator in machines.items():
        for row in rows(nls.flatten(actuator), given.draws, given.seed):
            print(f"| {title} | {row} |", flush=True)


if __name__ == "__main__":
    main()
