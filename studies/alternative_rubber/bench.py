"""The torque loop of a designed spring with many rubbers at once: runs of one compiled system."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

import nlsdesign as nls
from nlsdesign.components import Driven, Encoder, flat_relaxation
from nlsdesign.feedback.analysis.rest import rest_states
from nlsdesign.feedback.control import REPRODUCED_GAINS
from nlsdesign.feedback.observer import CascadeGain, ObserverDesign
from nlsdesign.foundation.arrays import Array
from nlsdesign.model import Variable
from nlsdesign.model.transform import with_signal
from nlsdesign.simulation.sampled_batch import run_batch

from .candidates import BRANCHES, without_loss

SAMPLE = 1e-3
"""Sample time in s of the published bench."""
SETTLED, COUNTED = 0.6, 1.0
"""Times in s: after the first, what happens in the second is evaluated."""
SUBSTEPS = 6
"""Steps of the plant per sample: friction is its fastest part, with 1,700 1/s at its rounded corner."""
RAMP = 0.05
"""Time in s in which a constant torque is reached; the corner sets off an oscillation where there is one."""
CURRENT = "controller.motor.current"
INTEGRAL = 100.0
"""Integral gain in rad/s² per N·m, the default of the controller; it decides nothing above 1 Hz."""
CYCLING = 1.0
"""Standard deviation of the motor current in A, while a constant torque is wanted, above which a loop
limit-cycles: 5 % of the limit of the current. A quiet loop has 0.1 to 0.3 A by the counts of the encoder."""


@dataclass(frozen=True)
class Rubber:
    """The rubber in the plant of one run: its loss tangent, and its modulus over the declared one."""

    loss_tangent: float
    modulus: float = 1.0


@dataclass(frozen=True)
class Run:
    """One run: the rubber, what is wanted, and how the load moves.

    Parameters
    ----------
    rubber
        In the plant.
    proportional
        Gain Kp of the torque loop.
    torque
        Constant torque that is wanted, or amplitude of a sine, in N·m.
    frequency
        Of the sine in Hz; zero for a constant torque.
    moved
        Amplitude of the load in rad, at the same frequency; the torque that is wanted is then zero.
    """

    rubber: Rubber
    proportional: float
    torque: float
    frequency: float = 0.0
    moved: float = 0.0


@dataclass(frozen=True, eq=False)
class Measured:
    """What many runs gave, at the samples.

    Parameters
    ----------
    runs
        What was asked.
    time
        In s, shape (T,).
    torque, estimate, current, deflection, desired
        Torque and estimate in N·m, motor current in A, deflection of the spring in rad, torque that was
        wanted in N·m, shape (runs, T).
    """

    runs: tuple[Run, ...]
    time: Array
    torque: Array
    estimate: Array
    current: Array
    deflection: Array
    desired: Array

    @cached_property
    def counted(self) -> slice:
        """The last second, in which every whole number of Hz has whole cycles."""
        return slice(len(self.time) - round(COUNTED / SAMPLE), None)

    @cached_property
    def cycling(self) -> NDArray[np.bool_]:
        """Whether a run with a constant torque limit-cycles or ran away, shape (runs,)."""
        quiet: NDArray[np.bool_] = np.std(self.current[:, self.counted], axis=1) < CYCLING
        return ~quiet

    def fundamental(self, signal: Array) -> NDArray[np.complex128]:
        """Return the complex amplitude of a sine at the frequency of each run, shape (runs,)."""
        turn = 2.0 * np.pi * np.array([[run.frequency] for run in self.runs]) * self.time[self.counted]
        # sin(ωt) = Im e^(iωt)
        amplitude: NDArray[np.complex128] = 2j * np.mean(signal[:, self.counted] * np.exp(-1j * turn), axis=1)
        return amplitude

    @cached_property
    def response(self) -> NDArray[np.complex128]:
        """Torque over the sine that was wanted, of the fundamentals, shape (runs,)."""
        return _over(self.fundamental(self.torque), [run.torque for run in self.runs])

    @cached_property
    def impedance(self) -> NDArray[np.complex128]:
        """Torque on the moved load over its angle in N·m/rad, of the fundamentals, shape (runs,)."""
        return _over(-self.fundamental(self.torque), [run.moved for run in self.runs])

    @cached_property
    def error(self) -> Array:
        """Root mean square of torque minus what was wanted, in N·m, shape (runs,)."""
        return _rms((self.torque - self.desired)[:, self.counted])

    @cached_property
    def estimate_error(self) -> Array:
        """Root mean square of estimated minus actual torque in N·m, shape (runs,)."""
        return _rms((self.estimate - self.torque)[:, self.counted])

    @cached_property
    def lost(self) -> Array:
        """Energy that the spring turns into heat per cycle, in J, shape (runs,)."""
        torque, angle = self.torque[:, self.counted], self.deflection[:, self.counted]
        torque, angle = (np.concatenate([x, x[:, :1]], axis=1) for x in (torque, angle))
        work = np.sum((torque[:, 1:] + torque[:, :-1]) / 2.0 * np.diff(angle, axis=1), axis=1)
        cycles = np.array([run.frequency * COUNTED for run in self.runs])
        lost: Array = np.where(cycles > 0.0, work, np.nan) / np.maximum(cycles, 1.0)
        return lost


def _over(values: NDArray[np.complex128], asked: Sequence[float]) -> NDArray[np.complex128]:
    """Return values over what was asked for; not a number where it is zero, for then nothing was asked."""
    by, result = np.array(asked), np.full(len(values), np.nan, dtype=complex)
    np.divide(values, by, out=result, where=by != 0.0)
    return result


def _rms(rows: Array) -> Array:
    values: Array = np.sqrt(np.mean(rows**2, axis=1))
    return values


@dataclass(frozen=True, eq=False)
class Bench:
    """Plant, observer and controller of one design; the rubber of the plant is that of each run.

    Every made spring is weighed once: the observer knows the modulus of the rubber in the plant, but has the
    loss that was declared.

    Parameters
    ----------
    actuator
        Designed, with the rubber that the observer knows.
    static
        Whether the observer has the static torque curve only.
    """

    actuator: nls.Assembly
    static: bool = False

    @cached_property
    def model(self) -> nls.FlatModel:
        """The actuator with its load held, on which observer and controller are designed."""
        return nls.flatten(self.actuator, outputs=["motor.angle", "spring.torque"])

    @cached_property
    def observer(self) -> ObserverDesign:
        """The observer, with the loss that was declared or with the static torque curve."""
        known = without_loss(self.actuator) if self.static else self.actuator
        return nls.design_observer_with_details(
            nls.flatten(known, outputs=["motor.angle", "spring.torque"]),
            sample_time=SAMPLE,
            gain=CascadeGain(),
        )

    @cached_property
    def loop(self) -> nls.ClosedLoop:
        """The closed loop; its load can be moved, and both ends of the spring have an encoder."""
        encoder = Encoder(of="load.angle", quantum=self.actuator.quantities()["motor_encoder.quantum"])
        parts = dict(self.actuator.parts) | {"load": Driven(), "load_encoder": encoder}
        moved = replace(self.actuator, parts=tuple(parts.items()))
        plant = nls.flatten(moved, outputs=["motor.angle", "spring.torque"])
        deflection = Variable("spring.angle.measured", "rad", "deflection as both encoders read it")
        plant = with_signal(
            plant, deflection, lambda n: n["motor_encoder.reading"] - n["load_encoder.reading"]
        )
        return nls.ClosedLoop(
            plant=plant,
            observer=self.observer.model,
            controller=nls.torque_controller(self.model, sample_time=SAMPLE, gains=REPRODUCED_GAINS),
            wires={
                "observer.motor.angle": "plant.spring.angle.measured",
                "controller.motor.angle": "plant.motor_encoder.reading",
            },
            substeps=SUBSTEPS,
        )

    @cached_property
    def start(self) -> dict[str, float]:
        """States of plant and observer at rest: rubber under pretension has relaxed."""
        model = self.model
        rest = rest_states(model, np.zeros(1), angle="motor.angle")[0]
        plant = {f"plant.{v.name}": float(x) for v, x in zip(model.states, rest, strict=True)}
        return plant | {f"observer.{name}": x for name, x in self.observer.start(0.0).items()}

    def run(self, runs: Sequence[Run], *, stop: float = SETTLED + COUNTED) -> Measured:
        """Simulate all runs in one call."""
        loop, count = self.loop, len(runs)
        time = SAMPLE * np.arange(round(stop / SAMPLE) + 1.0)
        modulus, gain, torque, frequency, moved = np.array(
            [(r.rubber.modulus, r.proportional, r.torque, r.frequency, r.moved) for r in runs]
        ).T[:, :, None]
        turn = 2.0 * np.pi * frequency
        wave = np.where(frequency > 0.0, np.sin(turn * time), np.minimum(time / RAMP, 1.0))
        inputs = {
            loop.desired: torque * wave / modulus,
            "plant.load.angle": moved * np.sin(turn * time),
            "plant.load.speed": moved * turn * np.cos(turn * time),
        }
        # Hundreds of runs share a few rubbers.
        tangents = {run.rubber.loss_tangent for run in runs}
        branches = {t: flat_relaxation(t, branches=BRANCHES).shares for t in tangents}
        shares = np.array([branches[run.rubber.loss_tangent] for run in runs])
        names = [f"plant.spring.rubber.relaxing.shares[{i + 1}]" for i in range(BRANCHES)]
        parameters = dict(zip(names, shares.T, strict=True))
        area = self.actuator.quantities()["spring.rubber.area"].number
        # All stresses scale alike, so a larger section is a larger modulus. The observer of a spring that was
        # weighed gives the torque times that factor: its loop is the one with all gains times the factor.
        parameters["plant.spring.rubber.area"] = area * modulus[:, 0]
        for name, value in (("proportional", gain), ("integral", INTEGRAL), ("compensation", 1.0)):
            parameters[f"controller.controller.{name}"] = (value * modulus)[:, 0]
        batch = run_batch(
            loop.system(list(inputs)), stop, inputs=inputs, parameters=parameters, start=self.start,
            keep=[loop.torque, loop.estimate, CURRENT, "plant.motor.angle", "plant.load.angle"],
            translate=nls.export.natively,
        )  # fmt: skip
        assert batch[loop.torque].shape[0] == count
        return Measured(
            tuple(runs), batch.time, batch[loop.torque], modulus * batch[loop.estimate], batch[CURRENT],
            batch["plant.motor.angle"] - batch["plant.load.angle"], torque * wave[:, : len(batch.time)],
        )  # fmt: skip
