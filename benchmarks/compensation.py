"""Hidden machines under the controllers of three decks: declared, diagnosed, and told the truth.

    python -m benchmarks.compensation --seed 1 --out out/compensation.json

Each machine is one of ``tests/rig``, which shares no model code with the package: built within the declared
spreads, with one hidden effect that a controller can reckon with. Its records are diagnosed, observer and
controller are generated as ``diagnose --regenerate`` does, and the rig itself runs under them, its encoder
counted, the current held for a millisecond. The truth is the declared deck with the true numbers of drive and
rubber and the effect at its true size. The torque error is the root mean square over the last two periods.
A run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from models.test_rig import test_rig_deck
from nlsdesign.bench.discrepancy import ALL, diagnose
from nlsdesign.bench.identification import RecordSet, load_records
from nlsdesign.bench.identification.least_squares import Fit
from nlsdesign.components import Assembly
from nlsdesign.export.c.guarded_step import GuardedModel
from nlsdesign.feedback.observer import CascadeGain, design_observer
from nlsdesign.foundation.errors import NlsError
from nlsdesign.model import FlatModel, flatten
from nlsdesign.regeneration import regenerate
from nlsdesign.regeneration.regenerated_controller import usual_controller
from nlsdesign.regeneration.watched_records import with_numbers
from tests.rig import ACTUATORS, Actuator, Hidden, make_records, truth, write_set
from tests.rig.bench import Servo, simulate
from tests.rig.commands import STEP, Command
from tests.rig.effects import scale_of

FREQUENCIES, SHARES = (0.8, 3.2), (0.35, 0.12)  # Hz, and amplitudes over the torque at 45°
PERIODS = 3


def sizes(hidden: Hidden) -> dict[str, dict[str, float]]:
    """Return the numbers of the package by effect at their true size."""
    wave = 0.8 * hidden.place_friction
    return {
        "none": {},
        "coulomb_friction": {"sliding_effort": hidden.friction},
        "stribeck_friction": {
            "sliding_effort": hidden.friction, "breakaway": hidden.breakaway,
            "stribeck_speed": hidden.stribeck_speed,
        },
        "load_dependent_friction": {"ratio": hidden.load_friction},
        "torque_ripple": {
            "sine": hidden.ripple * math.cos(hidden.ripple_phase),
            "cosine": hidden.ripple * math.sin(hidden.ripple_phase), "order": hidden.ripple_order,
        },
        "quadratic_drag": {"drag": hidden.drag},
        "constant_torque": {"load": -hidden.constant_torque},
        "gravity_load": {"horizontal_torque": hidden.weight, "hanging_angle": 0.0},
        "drive_delay": {"delay": hidden.drive_delay},
        "torque_constant_saturation": {"saturation": 1.0 / max(hidden.saturation, 1e-9)},
        "position_dependent_friction": {
            "sliding_effort": hidden.place_friction, "sine": wave * math.cos(hidden.place_phase),
            "cosine": wave * math.sin(hidden.place_phase),
        },
        "second_relaxation": {
            "modulus": hidden.branch_modulus, "viscosity": hidden.branch_modulus * hidden.branch_time,
        },
        "winding_heat": {
            "halving": 1.0 / math.sqrt(max(hidden.winding_heat, 1e-9) * hidden.winding_time),
            "cooling_time": hidden.winding_time,
        },
    }  # fmt: skip


def told(declared: Assembly, effect: str, built: Actuator, hidden: Hidden) -> Assembly:
    """Return the declared deck with the true numbers of drive and rubber, and the effect at its true size."""
    drive, rubber = built.drivetrain, built.rubber
    relaxing = "spring.cable.rubber.relaxing"
    numbers = {
        "motor.inertia": drive.inertia, "motor.torque_constant": drive.torque_constant,
        "bearing.damping": drive.viscosity, f"{relaxing}.spring.modulus": rubber.k,
        f"{relaxing}.dashpot.viscosity": rubber.eta,
    }  # fmt: skip
    numbers |= {f"spring.cable.rubber.stiff.modulus[{i}]": k for i, k in enumerate(rubber.k_star, start=1)}
    machine, wanted = declared.with_values(numbers), sizes(hidden)[effect]
    for candidate in (c for e in ALL if e.__name__ == effect for c in e(machine)):
        names = {unknown.name.rpartition(".")[2]: unknown.name for unknown in candidate.unknowns}
        if set(wanted) == set(names):
            return candidate.assembly.with_values({names[last]: value for last, value in wanted.items()})
    return machine


def wanted_torque(actuator: Actuator) -> Callable[[float], float]:
    """Return the desired torque in N·m over the time in s: two sines."""
    size = scale_of(actuator).torque

    def at(time: float) -> float:
        waves = zip(SHARES, FREQUENCIES, strict=True)
        return size * sum(share * math.sin(2.0 * math.pi * f * time) for share, f in waves)

    return at


def torque_error(
    machine: tuple[Actuator, Hidden], declared: Actuator, observer: FlatModel, controller: FlatModel
) -> float:
    """Return the rms torque error in N·m of the rig under an observer and a controller."""
    wanted, quantum = wanted_torque(declared), declared.sensors.angle_quantum
    watching, steering = GuardedModel(observer), GuardedModel(controller)
    acted = [0.0]

    def current(time: float, angle: float) -> float:
        read = {"motor.angle": quantum * round(angle / quantum), "motor.current": acted[0]}
        estimate = watching.step([read[v.name] for v in observer.inputs])[0][0]
        read |= {"spring.torque.desired": wanted(time), "spring.torque": estimate}
        acted[0] = steering.step([read[v.name] for v in controller.inputs])[0][0]
        return acted[0]

    time = np.arange(round(PERIODS / FREQUENCIES[0] / STEP)) * STEP
    still = Command(time, np.zeros_like(time), np.zeros_like(time))
    history = simulate(*machine, Servo.for_actuator(declared), still, current)
    counted = time >= 1.0 / FREQUENCIES[0]
    error = history.torque - np.array([wanted(t) for t in time])
    return float(np.sqrt(np.mean(error[counted] ** 2)))


def judged(actuator: str, effect: str, seed: int) -> Mapping[str, object]:
    """Return what the diagnosis named, and the torque errors under the three decks, in mN·m."""
    made = ACTUATORS[actuator]
    with TemporaryDirectory() as folder:
        write_set(Path(folder), made, make_records(made, hidden_of(effect), seed))
        declared = test_rig_deck(Path(folder) / "rig.toml", Path(folder) / "cam.csv")
        records = load_records(Path(folder), flatten(declared))
    verdict = diagnose(declared, records)
    named = [e.name for e in verdict.effects]
    return {"named": named} | judged_under(
        made, effect, seed, declared=declared, records=records, better=verdict.actuator, fits=verdict.fits
    )


def hidden_of(effect: str) -> dict[str, float]:
    """Return the strength of an effect by name."""
    return {} if effect == "none" else {effect: 1.0}


def judged_under(
    made: Actuator, effect: str, seed: int, *,
    declared: Assembly, records: RecordSet, better: Assembly, fits: Sequence[Fit],
) -> dict[str, object]:  # fmt: skip
    """Return the torque errors of a machine under three decks, in mN·m, and what was said of the second."""
    machine, plant = truth(made, hidden_of(effect), seed), flatten(declared)
    result = regenerate(plant, flatten(better), records, fits=fits)
    row: dict[str, object] = {"said": [*result.words(), *result.reasons]}

    def error(observer: FlatModel, controller: FlatModel) -> float:
        return 1e3 * torque_error(machine, made, observer, controller)

    row["before"] = error(design_observer(plant, gain=CascadeGain()), usual_controller(plant, 1e-3)[0])
    if result.controller is not None and result.observer is not None:
        row["after"] = error(result.observer, result.controller.controller)
        row["kept"] = result.controller.kept
    true = flatten(told(declared, effect, *machine))
    try:
        observer = design_observer(true, gain=CascadeGain())
    except NlsError:  # as the package does
        observer = design_observer(with_numbers(plant, true.values), gain=CascadeGain())
    row["told"] = error(observer, usual_controller(true, 1e-3)[0])
    return row


def shown(rows: Mapping[str, Mapping[str, object]]) -> str:
    """Return all machines as a table, and how many err how much more than one that is told the truth."""
    lines = [
        "| machine, hidden effect | named | declared | diagnosed | told |",
        "| --- | --- | --- | --- | --- |",
    ]
    told_ratios, ratios = [], []
    for name, row in rows.items():
        actuator, effect, _ = name.split(" ")
        before, after, true = (float(str(row.get(k, math.nan))) for k in ("before", "after", "told"))
        named = " and ".join(map(str, np.ravel(row["named"]))) or "nothing"
        errors = " | ".join("none" if math.isnan(e) else f"{e:.3g}" for e in (before, after, true))
        lines.append(f"| {actuator}, {effect} | {named} | {errors} |".replace("_", " "))
        told_ratios.append(after / true)
        ratios.append(after / before)
    near, worse = (np.sum(np.array(r) <= most) for r, most in ((told_ratios, 1.1), (ratios, 1.02)))
    lines.append(f"\n{near} of {len(rows)} err at most 1.1 times as much as one that is told the truth,")
    lines.append(f"{worse} at most 1.02 times as much as under the declared deck")
    return "\n".join(lines)


def main() -> int:
    """Judge all machines of a seed and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument(
        "--out", type=Path, required=True, help="JSON file that is written after each machine"
    )
    parser.add_argument("--effects", nargs="*", default=list(sizes(Hidden())))
    parser.add_argument("--actuators", nargs="*", default=list(ACTUATORS))
    given = parser.parse_args()
    rows = json.loads(given.out.read_text("utf-8")) if given.out.exists() else {}
    for effect in given.effects:
        for actuator in given.actuators:
            name = f"{actuator} {effect} {given.seed}"
            if name not in rows:
                rows[name] = judged(actuator, effect, given.seed)
                given.out.parent.mkdir(parents=True, exist_ok=True)
                given.out.write_text(json.dumps(rows, indent=1), "utf-8")
            print(name, {k: v for k, v in rows[name].items() if k != "said"}, flush=True)
    print(shown(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
