"""Fits of a simulated model to windows of the records: the system identification toolbox of MuJoCo.

The declared machine becomes a model of MuJoCo. What the toolbox can estimate of such a model is fitted to
windows of all records, first for the declared machine, then with one candidate more at a time: dry friction,
damping linear and of second order, weight, damping of the spring, a bias of the drive, a delay and a bias of
readings. Schwarz's criterion decides as in ``least_squares``, with the same least share. Other names have no
entry.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

from benchmarks.methods._balance import RESOLVED, Balance, Deck, Motion, criterion
from benchmarks.methods.least_squares import GAIN, MOST

NAME = f"MuJoCo's system identification (mujoco {version('mujoco')}), BIC"
WINDOW, EVERY = 1.0, 4
"""s of a window, and how many windows there are for each one that is used: all of them take minutes."""
ITERATIONS = 5
LEVER = 0.05  # m, of the weight
LATEST = 0.05  # s, the largest delay of a reading
DELAYS = (0.003, 0.006, 0.012, 0.024)  # s, of the current


Takes = Callable[[Any, float], None]
"""What puts a number into the specification of a model."""


@dataclass(frozen=True)
class Entry:
    """A number that the toolbox may estimate, in units of a size of its own.

    Parameters
    ----------
    name, part
        Effect and part as an answer gives them.
    size
        SI.
    takes
        How the model takes the number; ``None`` where it changes readings.
    start, bounds
        In sizes.
    reading
        ``delay`` or ``bias`` where it changes readings; ``late`` where the current acts later by the size.
        That is not fitted, since a window begins in a state that knows of no earlier current.
    of
        Sensors whose readings it changes.
    """

    name: str
    part: str
    size: float
    takes: Takes | None = None
    start: float = 0.1
    bounds: tuple[float, float] = (0.0, 10.0)
    reading: str = ""
    of: str = "*"


def answer(folder: Path) -> dict[str, Any]:
    """Return the effects that are added one after the other.

    Parameters
    ----------
    folder
        Of the case.
    """
    fit = _Fit(Balance(folder))
    taken: list[Entry] = []
    left, rows = fit.left(taken)
    whole = criterion(left, rows, 0)
    while len(taken) < MOST:
        named = {(entry.name, entry.part) for entry in taken}
        others = [entry for entry in fit.entries if (entry.name, entry.part) not in named]
        tried = [(fit.left([*taken, entry])[0], entry) for entry in others]
        best, entry = min(tried, key=lambda row: row[0])
        if criterion(best, rows, len(taken) + 1) >= whole or best > (1.0 - GAIN) * left:
            break
        taken, left, whole = [*taken, entry], best, criterion(best, rows, len(taken) + 1)
    return {"effects": [{"name": entry.name, "part": entry.part} for entry in taken]}


class _Fit:
    """Fits of one case."""

    def __init__(self, balance: Balance) -> None:
        self.deck, motions = balance.deck, balance.motions
        self.step = motions[0].step
        self.declared = _declared_entries(self.deck, motions)
        self.entries = _candidates(self.deck, motions)
        self.windows = [w for motion in motions for w in _windows(motion)][::EVERY]

    def left(self, more: list[Entry]) -> tuple[float, int]:
        """Return the sum of squares that a fit leaves in as many rows as are independent, and how many."""
        entries = [*self.declared, *(entry for entry in more if entry.reading != "late")]
        late = sum(entry.size for entry in more if entry.reading == "late")
        spec = mujoco.MjSpec.from_string(_model(self.deck, self.step))
        params, transform = sysid.ParameterDict(), sysid.SignalTransform(normalize=False)
        for number, entry in enumerate(entries):
            # The toolbox takes delays and biases of readings in SI.
            unit = entry.size if entry.reading else 1.0
            begin, low, high = (unit * each for each in (entry.start, *entry.bounds))
            parameter = sysid.Parameter(f"p{number}", begin, low, high, modifier=_modifier(entry))
            params.add(parameter)
            if entry.reading:
                getattr(transform, entry.reading)(entry.of, parameter)
        residual = sysid.build_residual_fn(
            models_sequences=[self._sequences(spec, late)], modify_residual=transform.apply, n_threads=1
        )
        with contextlib.redirect_stdout(io.StringIO()):
            _, result = sysid.optimize(params, residual, verbose=False, max_iters=ITERATIONS)
        rest = np.concatenate([np.ravel(each) for each in residual(result.x, params)[0]])
        rows = round(len(rest) * min(2.0 * RESOLVED * self.step, 1.0))
        return float(rest @ rest) * rows / len(rest), rows

    def _sequences(self, spec: Any, late: float) -> Any:
        model = spec.compile()
        two = self.deck.load is not None
        names, states, controls, readings = [], [], [], []
        for number, (m, cut) in enumerate(self.windows):
            place, speed = [m.place[cut][0]], [m.speed[cut][0]]
            if two:
                place, speed = [*place, m.load_place[cut][0]], [*speed, m.load_speed[cut][0]]
            time = self.step * np.arange(cut.stop - cut.start)
            shown = np.column_stack([m.place[cut], m.load_place[cut]][: 1 + two])
            names.append(f"w{number}")
            states.append(sysid.create_initial_state(model, np.array(place), np.array(speed)))
            controls.append(sysid.TimeSeries(time, m.delayed(m.current, late)[cut][:, None]))
            readings.append(sysid.TimeSeries.from_names(time, shown, model))
        return sysid.ModelSequences("machine", spec, names, states, controls, readings)


def _windows(m: Motion) -> list[tuple[Motion, slice]]:
    length = round(WINDOW / m.step)
    return [(m, slice(k, k + length)) for k in range(0, len(m.place) - length, length)]


def _model(deck: Deck, step: float) -> str:
    """Return the declared machine as MJCF; a weight hangs on the last body."""
    kind, axis = ("hinge", "0 1 0") if deck.turns else ("slide", "1 0 0")

    def body(name: str) -> str:
        point = f'<inertial pos="0 0 {-LEVER}" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'
        return f'<body name="{name}">{point}<joint name="{name}" type="{kind}" axis="{axis}"/></body>'

    bodies = ["motor", "load"][: 1 + bool(deck.load)]
    sensors = "".join(f'<jointpos name="{name}" joint="{name}"/>' for name in bodies)
    tie = (
        '<tendon><fixed name="spring"><joint joint="motor" coef="1"/><joint joint="load" coef="-1"/></fixed>'
        "</tendon>"
    )
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{step:g}" integrator="implicitfast">'
        '<flag contact="disable"/></option>'
        f"<worldbody>{''.join(map(body, bodies))}</worldbody>{tie if deck.load else ''}"
        f'<actuator><general name="drive" joint="motor" gainprm="{deck.per_ampere:.9g}" biastype="affine"/>'
        "</actuator>"
        f"<sensor>{sensors}</sensor></mujoco>"
    )


def _modifier(entry: Entry) -> Callable[[Any, Any], None] | None:
    takes = entry.takes
    return None if takes is None else lambda spec, p: takes(spec, entry.size * float(p.value[0]))


def _put(part: Any, field: str, value: float, power: int = 0) -> None:
    """Set a number of a part, or one coefficient where MuJoCo has a polynomial of the speed or the way."""
    if np.ndim(getattr(part, field)):
        getattr(part, field)[power] = value
    else:
        setattr(part, field, value)


def _joint(name: str, field: str, power: int = 0) -> Takes:
    return lambda spec, value: _put(spec.joint(name), field, value, power)


def _weight(name: str) -> Takes:
    return lambda spec, value: setattr(spec.body(name), "mass", max(value, 1e-6) / (9.81 * LEVER))


def _spring(field: str) -> Takes:
    return lambda spec, value: _put(spec.tendon("spring"), field, value)


def _bias(spec: Any, value: float) -> None:
    spec.actuator("drive").biasprm[0] = value


def _sizes(motions: list[Motion], deck: Deck) -> tuple[float, float]:
    """Return a tenth of the largest effort of the drive, and that over the largest speed."""
    effort = 0.1 * deck.per_ampere * max(np.max(np.abs(m.current)) for m in motions)
    return effort, effort / max(np.max(np.abs(m.speed)) for m in motions)


def _declared_entries(deck: Deck, motions: list[Motion]) -> list[Entry]:
    """Return what the deck declares; the gain of the drive holds the scale."""
    effort, drag = _sizes(motions, deck)
    near = {"start": 1.0, "bounds": (0.5, 2.0)}
    made = [Entry("inertia", deck.motor, deck.inertia, _joint("motor", "armature"), **near)]
    last = "load" if deck.load else "motor"
    if deck.has["damping"]:
        made.append(Entry("damping", deck.motor, drag, _joint("motor", "damping")))
    if deck.load:
        made.append(Entry("inertia", deck.load, deck.load_inertia, _joint("load", "armature"), **near))
        made.append(Entry("stiffness", deck.load, deck.stiffness, _spring("stiffness"), **near))
        if deck.has["load_damping"]:
            made.append(Entry("damping", deck.load, drag, _joint("load", "damping")))
        if deck.has["spring_damping"]:
            made.append(Entry("damping", deck.load, drag, _spring("damping")))
    if deck.has["weight"]:
        made.append(Entry("weight", deck.motor, effort, _weight(last)))
    return made


def _candidates(deck: Deck, motions: list[Motion]) -> list[Entry]:
    """Return what the toolbox can add."""
    (effort, drag), motor = _sizes(motions, deck), deck.motor
    either = (-10.0, 10.0)
    fastest = effort / drag
    made = [
        Entry("coulomb_friction", motor, effort, _joint("motor", "frictionloss")),
        Entry("quadratic_drag", motor, drag / fastest, _joint("motor", "damping", 1)),
        Entry("current_sensor_bias", motor, effort, _bias, bounds=either),
        *(Entry("drive_delay", motor, late, reading="late") for late in DELAYS),
    ]
    if not deck.has["damping"]:
        made.append(Entry("viscous_friction", motor, drag, _joint("motor", "damping")))
    if deck.turns and not deck.has["weight"]:
        made.append(
            Entry("gravity_load", deck.load or motor, effort, _weight("load" if deck.load else "motor"))
        )
    if deck.load:
        lead = 0.1 * max(np.max(np.abs(m.place - m.load_place)) for m in motions)
        made += [
            Entry("coulomb_friction", deck.load, effort, _joint("load", "frictionloss")),
            Entry("angle_sensor_bias", deck.load, lead, reading="bias", of="load", bounds=either),
            Entry("angle_sensor_delay", deck.load, LATEST, reading="delay", of="load", bounds=(0.0, 1.0)),
        ]
        if not deck.has["spring_damping"]:
            made.append(Entry("spring_damping", motor, drag, _spring("damping")))
    return made
