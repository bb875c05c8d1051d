"""Whether a checked design can be made, will hold, and its torque can be known: yes, no, or unknown."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from ..design import CamDesign, Limit
from ..design.drawing.making import Mounting, carrying_note, process_of
from ..design.jobs.written_design import declared_edge
from ..design.optimisation.defaults import strain_ends
from ..design.optimisation.limits import limit_kinds
from ..design.tolerance.causes import LastingCause
from ..feedback.observer import least_torque_error, observer_bench
from ..foundation.errors import NlsError
from ..foundation.written_numbers import prefixed
from ..model import FlatModel, flatten
from ..model.roles import series_cam
from ..simulation import declared_prior

_LARGEST_ERROR = 0.05
"""Assumed: part of the largest torque by which a made spring may err, and its torque may be unknown, rms."""
_BROKEN = 5e-4
_STRENGTHS = {
    "rubber": {"MaximumStrain", "MaximumStress"},
    "cable": {"MaximumCableTension"},
    "coil": {"GoodmanSafety"},
}
"""Limits of which one at least must hold of what a spring is made of, or nobody knows whether it holds."""
YES, NO, UNKNOWN = "yes", "no", "unknown"


class Light(NamedTuple):
    """One question that decides whether a design is worth building."""

    asked: str  # "can be made", "will hold" or "will be known"
    answer: str  # "yes", "no" or "unknown"
    words: str  # by what


def lights_of(design: CamDesign, keep: tuple[Limit, ...], mounting: Mounting | str) -> tuple[Light, ...]:
    """Return the three lights of a finished design.

    ``keep``: all limits that held; ``mounting``: as :func:`mounting_of` gives it.
    """
    model = flatten(design.actuator)
    return (
        Light("can be made", *can_be_made(design, mounting)),
        Light("will hold", *will_hold(design, model, {type(each).__name__ for each in keep})),
        Light("will be known", *will_be_known(model, design.target.largest)),
    )


def mounting_of(design: CamDesign) -> Mounting | str:
    """Return the part of a design, with bolts where some carry its torque; or why there is none.

    The reason is empty where no cable is declared, so that nobody knows the edge.
    """
    kind, radius = declared_edge(design.actuator, series_cam(flatten(design.actuator)))
    if radius is None:
        return ""
    torque, tension = float(abs(design.check.torques).max()), float(design.curves.forces.max())
    try:
        machined = kind(**{"cable_radius": radius})  # type: ignore[arg-type]
        plain = Mounting(machined, design.contour, machined.part(design.contour), torque, tension)
        carry = plain.bolts_that_carry()
        if carry is None:
            return plain
        bolted = replace(machined, bolts=carry[0])
        return replace(plain, machined=bolted, part=bolted.part(design.contour))
    except NlsError as error:
        return str(error)


def can_be_made(design: CamDesign, mounting: Mounting | str) -> tuple[str, str]:
    """Return whether the edge can be cut and held, and made springs are alike enough: answer and reason."""
    largest, made = design.target.largest, design.tolerance
    if not design.met:
        return NO, f"even with exact numbers the torque errs by {prefixed(design.rms)} rms"
    if mounting == "":
        return UNKNOWN, "the deck declares no cable, so that there is no edge to cut"
    if isinstance(mounting, str):
        return NO, mounting
    if made is None or not made.causes:
        return UNKNOWN, "the deck declares no spread, so that nobody knows how made springs differ"
    built, trim = made.quantiles[-1].value, made.trims[0] if made.trims else None
    words = f"95 % of made springs err by less than {prefixed(built)} rms"
    if trim is not None and built > _LARGEST_ERROR * largest:
        words += f", {prefixed(trim.quantiles[-1].value)} once {trim.name} is set on the bench"
        built = trim.quantiles[-1].value
    if built > _LARGEST_ERROR * largest:
        return (
            NO,
            f"{words}; {prefixed(_LARGEST_ERROR * largest)} would do: tighten {made.tighten_first}",
        )
    carried = carrying_note(mounting.part, mounting.torque)
    if mounting.machined.bolts is None:
        return UNKNOWN, f"no bolts that carry {prefixed(mounting.torque)} fit: {mounting.key_that_does()}"
    return YES, f"{words}; {process_of(mounting.part)}; {carried}"


def will_hold(design: CamDesign, model: FlatModel, kept: set[str]) -> tuple[str, str]:
    """Return whether limits and what is stated of the rubber hold, and for how long: answer and reason."""
    strengths = [each for each in design.limits if each.limit in limit_kinds()]
    for each in strengths:
        past = (each.value - each.bound) * (1.0 if each.upper else -1.0)
        if past > _BROKEN * abs(each.bound):
            kind = limit_kinds()[each.limit]
            return NO, f"{each.of} is {kind.shown(each.value)}, allowed {kind.shown(each.bound)}"
    for name, end in strain_ends(model).items():
        if max(design.curves.strains[name]) > end.strain * (1.0 + _BROKEN):
            return NO, f"{name} is stretched further than is stated of it"
    cam = series_cam(model)
    parts = {"rubber": cam.specimens, "cable": cam.cable, "coil": cam.coils}
    unstated = [name for name, there in parts.items() if there and not kept & _STRENGTHS[name]]
    if unstated:
        return UNKNOWN, f"no strength is declared, and no limit set, of {' and '.join(unstated)}"
    within = f"within its limits: {', '.join(sorted({each.of for each in strengths}))}"
    made = design.tolerance
    if made is None:
        return YES, within
    for effect in made.causes:
        if isinstance(effect.cause, LastingCause) and effect.alone > _LARGEST_ERROR * design.target.largest:
            return NO, f"time takes up to {prefixed(effect.alone)} rms of the torque: {effect.cause.source}"
    return YES, "; ".join((within, *made.over_time))


def will_be_known(model: FlatModel, largest: float) -> tuple[str, str]:
    """Return whether sensors and spreads let an observer know the torque: answer and reason."""
    try:
        least = least_torque_error(observer_bench(model))(declared_prior(model))
    except NlsError as error:
        return UNKNOWN, str(error)
    words = f"no observer errs by less than {prefixed(least)} rms over the declared spreads"
    return (YES if least <= _LARGEST_ERROR * largest else NO), words
