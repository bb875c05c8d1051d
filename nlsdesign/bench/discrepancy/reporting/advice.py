"""What to measure next: which experiment tells apart what these records cannot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...identification.least_squares import Fit
from ..selection.comparison import Judged

_APART = 1.0

_EXPERIMENTS: Mapping[frozenset[str], str] = {
    frozenset(pair): words
    for pair, words in (
        (
            ("coulomb_friction", "stribeck_friction"),
            "turn through several revolutions of speed from creeping to fast at constant load: only Stribeck "
            "friction falls with the speed",
        ),
        (
            ("coulomb_friction", "load_dependent_friction"),
            "run the same motion without load and with a large one: only the friction of a loaded gear grows",
        ),
        (
            ("cable_slack", "permanent_set"),
            "pull fresh rubber once, let it rest for minutes and pull again: slack is there from the first "
            "pull, set only after it",
        ),
        (
            ("cable_slack", "cable_compliance"),
            "pull slowly through small forces: slack leaves a dead length, compliance a slope that is off by "
            "the same share everywhere",
        ),
        (
            ("cable_slack", "backlash"),
            "hold the cam by hand and turn the motor: backlash turns without force on both sides, and with "
            "the angle also measured behind the gear it is seen directly",
        ),
        (
            ("force_sensor_bias", "cable_slack"),
            "read the load cell with the cable taken off: a bias stays",
        ),
        (
            ("force_sensor_delay", "second_relaxation"),
            "record a fast sine and a long hold: a delay is the same time at any frequency and leaves a hold "
            "alone, relaxation goes on during the hold",
        ),
        (
            ("current_sensor_bias", "coulomb_friction"),
            "stand still, and move slowly both ways with the spring taken off: an offset keeps its sign when "
            "the motion turns, friction does not",
        ),
        (
            ("current_sensor_bias", "constant_torque"),
            "read the ammeter with the drive switched off: a bias stays",
        ),
        (
            ("asymmetric_friction", "constant_torque"),
            "let the body coast to rest from both directions, and stand: a torque goes on acting at rest",
        ),
        (
            ("asymmetric_friction", "constant_force"),
            "let the body coast to rest from both directions, and stand: a force goes on acting at rest",
        ),
        (
            ("asymmetric_friction", "current_sensor_bias"),
            "read the ammeter with the drive switched off: a bias stays",
        ),
        (
            ("command_compression", "torque_constant_saturation"),
            "stall the drive and step the command up to its limit: iron is proportional at first, a "
            "compressed command falls short from the first step on",
        ),
        (
            ("gravity_load", "angle_sensor_eccentricity"),
            "hold the body at rest all round: a weight takes torque there, an eccentric disc none",
        ),
        (
            ("winding_heat", "torque_constant_drift"),
            "record once after a rest and once after minutes of hard work: heat follows the work, drift "
            "the time",
        ),
        (
            ("force_sensor_delay", "clock_drift"),
            "record the same motion for ten times as long: a clock that drifts goes on losing time",
        ),
        (
            ("force_sensor_gain", "strain_stiffening"),
            "hang a known weight on the load cell",
        ),
        (
            ("stress_softening", "permanent_set"),
            "load to a small, a large and again the small stretch, then rest: softening lowers the force at "
            "the same stretch, set moves the place where force begins",
        ),
        (
            ("rate_independent_hysteresis", "second_relaxation"),
            "run the same triangle at a tenth and at ten times the speed, and hold at the turning points: "
            "dry loops are equally wide and do not creep",
        ),
        (
            ("self_heating", "stress_softening"),
            "cycle for minutes, cool for as long, and repeat: what comes from heat comes back",
        ),
    )
}


def experiment(one: str, other: str) -> str | None:
    """Return the experiment that tells two effects apart, if one is known."""
    return _EXPERIMENTS.get(frozenset((one, other)))


def where_they_differ(one: Sequence[Judged], other: Sequence[Judged]) -> str:
    """Return in words where the predictions of two hypotheses are furthest apart, in noise floors."""
    best, sentence = 0.0, "their predictions agree on every record"
    for a, b in zip(one, other, strict=True):
        gap = np.abs(a.residual - b.residual)
        most = float(np.sqrt(np.mean(gap**2)))
        if most > best:
            best, place = most, int(np.argmax(gap))
            at = float(a.record.trace.time[a.floor.places[place]])
            sentence = (
                f"here they differ most in record '{a.record.name}' at `{a.block.name}`, "
                f"by {most:.2g} noise floors, around {at:.3g} s"
            )
    longer = "; repeat that motion with more periods or larger amplitude" if 0.0 < best < _APART else ""
    return sentence + longer


def advice(name: str, aliases: Mapping[str, str]) -> tuple[str, ...]:
    """Return one sentence for each effect that explains the records as well."""
    sentences = []
    for other, differ in aliases.items():
        known = experiment(name, other)
        words = f"{name} or {other}: " + (f"{known}; {differ}" if known else differ)
        sentences.append(words + ".")
    return tuple(sentences)


_DECIDING: Mapping[str, str] = {
    "kg*m^2": "faster reversals, so that inertia shows beside the other torques",
    "kg": "faster reversals, so that inertia shows beside the other forces",
    "N*m*s/rad": "the same motion at a third and at three times the speed",
    "N*s/m": "the same motion at a third and at three times the speed",
    "Pa*s": "the same amplitude at a third and at three times the frequency, and a hold of many seconds",
    "Pa": "a larger amplitude, so that the rubber is stretched through all of its range, and a hold",
    "N/m": "a larger amplitude",
    "N*m/rad": "a larger amplitude",
    "N*m": "slow turns both ways",
    "N": "slow pulls both ways",
    "N*m/A": "a known weight hung on a lever at rest",
    "s": "steps and a fast sine beside the slow motion",
}
"""By the unit of a number, the motion in which it acts unlike others."""


def more_excitation(fits: Sequence[Fit]) -> tuple[str, ...]:
    """Return what to record where the records leave numbers or combinations of them open."""
    sentences = []
    for fit in fits:
        units = {p.name: p.unit for p in fit.parameters}
        for words in fit.unidentified():
            named = [u for n, u in units.items() if f"{n} up" in words or f"{n} down" in words]
            known = list(dict.fromkeys(_DECIDING[u] for u in named if u in _DECIDING))
            wanted = (
                "; ".join(known) or "another amplitude, speed or holding time in which these act differently"
            )
            sentences.append(f"The records do not decide {words}. To decide it, record {wanted}.")
    return tuple(sentences)
