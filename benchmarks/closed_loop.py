"""Torque loop: 20 frequencies with counts, against python-control on the same loop; 1,000 draws.

The peer gets the same plant (the same equations through CasADi, one evaluation per call), the same observer
and controller stepped at the same sample time, the same counts of the encoder and the same sample of delay:
python-control has no sampled controller beside a continuous plant, so the whole sample (plant by ten
Runge–Kutta steps, observer, controller, delay) is stated as one discrete ``NonlinearIOSystem`` and run by
``input_output_response``. What it does not do is decide how long to run: it gets the frequencies and
durations that ours took. The peer is run on a part of them and scaled by the number of samples, which it
takes at an even pace.
"""

from __future__ import annotations

import time

import casadi as ca
import control
import numpy as np

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export import natively
from nlsdesign.feedback.control import (
    ClosedLoop,
    TorqueGains,
    encoder_loop,
    loop_over_spread,
    sine_response,
    torque_controller,
)
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten

AMPLITUDE, FREQUENCIES = 0.8, np.geomspace(0.1, 11.0, 20)
PEER_SAMPLES = 1500
SETTLE = 0.5


def published_loop() -> ClosedLoop:
    """Return the loop of the published actuator with default gains."""
    plant = flatten(
        declare(load_deck("austin2015_figure_consistent")), outputs=["motor.angle", "spring.torque"]
    )
    controller = torque_controller(plant, gains=TorqueGains())
    return encoder_loop(plant, observer=design_observer(plant, gain=CascadeGain()), controller=controller)


def peer(loop: ClosedLoop) -> tuple[control.NonlinearIOSystem, np.ndarray]:
    """Return the same loop as a discrete system of python-control, and its start."""
    plant, observer, controller = loop.plant, loop.observer, loop.controller
    step, parts = loop.sample_time, (plant, observer, controller)
    sizes = [len(m.states) for m in parts]
    reading = next(r.signal for r in plant.readings)
    place = [v.name for v in plant.signals].index(reading)
    torque = [v.name for v in plant.outputs].index("spring.torque")
    numbers = [m.start(m.parameters) for m in parts]

    def evaluated(i: int, x: np.ndarray, u: list[float]) -> tuple[np.ndarray, ...]:
        w = parts[i].look_up(list(x), u)
        return tuple(np.array(r).ravel() for r in parts[i].equations(0.0, x, u, numbers[i], w)[:3])

    def sample(x: np.ndarray, desired: float) -> tuple[np.ndarray, float]:
        xp, xo, xc, acting = np.split(x, np.cumsum(sizes))
        _, y, s = evaluated(0, xp, [float(acting[0])])
        given = {"motor.angle": s[place], "motor.current": acting[0]}
        xo, estimate, _ = evaluated(1, xo, [float(given[v.name]) for v in observer.inputs])
        given |= {v.name: e for v, e in zip(observer.outputs, estimate, strict=True)}
        given |= {"spring.torque.desired": desired, "motor.angle": s[place]}
        xc, current, _ = evaluated(2, xc, [float(given[v.name]) for v in controller.inputs])
        h = step / loop.substeps
        for _ in range(loop.substeps):
            ks = []
            for share in (0.0, 0.5, 0.5, 1.0):
                at = xp + share * h * ks[-1] if ks else xp
                ks.append(evaluated(0, at, [float(acting[0])])[0])
            xp = xp + h / 6.0 * (ks[0] + 2 * ks[1] + 2 * ks[2] + ks[3])
        return np.concatenate([xp, xo, xc, current[:1]]), float(y[torque])

    def update(_t: float, x: np.ndarray, u: np.ndarray, _p: dict[str, float]) -> np.ndarray:
        return sample(x, float(u[0]))[0]

    def output(_t: float, x: np.ndarray, _u: np.ndarray, _p: dict[str, float]) -> np.ndarray:
        return np.array([evaluated(0, x[: sizes[0]], [float(x[-1])])[1][torque]])

    begin = np.concatenate([*(m.start(m.states) for m in parts), [0.0]])
    system = control.NonlinearIOSystem(
        update, output, inputs=["desired"], outputs=["torque"], states=len(begin), dt=step
    )
    return system, begin


def main() -> None:
    """Print the times and the ratio."""
    loop = published_loop()
    begin = time.perf_counter()
    sine_response(loop, amplitude=AMPLITUDE, frequencies=FREQUENCIES, translate=natively)
    first = time.perf_counter() - begin
    begin = time.perf_counter()
    response = sine_response(loop, amplitude=AMPLITUDE, frequencies=FREQUENCIES, translate=natively)
    ours = time.perf_counter() - begin
    cycles = np.maximum(np.ceil(0.25 * response.frequency), 1.0)
    samples = float(np.sum(SETTLE + 2.0 * cycles / response.frequency)) / loop.sample_time

    system, start = peer(loop)
    at = loop.sample_time * np.arange(PEER_SAMPLES)
    wanted = AMPLITUDE * np.sin(2 * np.pi * 2.0 * at)
    begin = time.perf_counter()
    run = control.input_output_response(system, at, wanted, start)
    theirs = (time.perf_counter() - begin) * samples / PEER_SAMPLES
    same = loop.run(at[-1], inputs={loop.desired: lambda t: AMPLITUDE * np.sin(2 * np.pi * 2.0 * t)})
    difference = float(np.max(np.abs(same[loop.torque] - np.ravel(run.outputs))))

    begin = time.perf_counter()
    spread = loop_over_spread(loop, amplitude=AMPLITUDE, frequency=1.0, draws=1000, translate=natively)
    drawn = time.perf_counter() - begin
    print(f"20 frequencies with counts: {ours:.2f} s, with compilation {first:.2f} s")
    print(f"python-control {control.__version__} on the same loop: {theirs:.0f} s, ratio {theirs / ours:.0f}")
    print(f"largest difference of the torque {1e3 * difference:.2g} mN·m in {PEER_SAMPLES} samples")
    print(f"1,000 draws: {drawn:.1f} s; {spread}")


if __name__ == "__main__":
    print(f"casadi {ca.__version__}")
    main()
