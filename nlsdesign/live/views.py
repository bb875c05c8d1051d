"""What is shown of designs: curves, limits in words, strains beyond what is stated of the rubber."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping

import numpy as np

from ..design import CamDesign, LimitState
from ..design.optimisation.defaults import StrainEnd
from ..design.optimisation.limits import limit_kinds
from ..design.optimisation.result import DesignCurves
from ..design.parametric.cam_question import LimitNumber, NumberState
from ..design.parametric.parametric_solver import ParametricDesign
from ..design.statics.equilibrium import cam_function, elastic_law
from ..foundation.arrays import Array
from ..model import FlatModel
from .answers import DesignView, LimitMargin, LiveColumn, LiveControls
from .question import LiveQuestion

_OTHERS = {
    "MaximumTorqueError": "torque error that is allowed",
    "NumberRange": "range of a free number",
    "RestLengthRange": "its rest length",
    "AnchorClearance": "clearance of the anchor",
    "ConvexContour": "convexity",
    "PullingCable": "pull of the cable",
}
"""Limits that the page has no slider for."""
_NO_LIMITS: Mapping[str, LimitNumber] = {}


def in_words(sentence: str, limits: Mapping[str, LimitNumber] = _NO_LIMITS) -> str:
    """Return a sentence with each limit called what it limits, with its number where it has one."""
    kinds = limit_kinds()
    names = "|".join([*kinds, *_OTHERS])

    def read(match: re.Match[str]) -> str:
        name = match.group()
        if name not in kinds:
            return _OTHERS[name]
        kind = kinds[name]
        return f"{kind.title} ({kind.shown(limits[name].value)})" if name in limits else kind.title

    # A name in brackets stands behind what it limits; a number of it is left only where none stands there.
    stated = re.sub(
        rf"( [<>]= [^;,]*)? \((?:limit )?({names})(?:, (?:{names}))*\)",
        lambda m: m[1] or (f" ({kinds[m[2]].shown(limits[m[2]].value)})" if m[2] in limits else ""),
        sentence,
    )
    return re.sub(rf"\b(?:{names})\b", read, stated).replace(" <= ", " ≤ ").replace(" >= ", " ≥ ")


def shown_value(margin: LimitMargin, value: float) -> str:
    """Return a number of a limit in the unit in which people read it."""
    return limit_kinds()[margin.limit].shown(value) if margin.limit in limit_kinds() else margin.shown(value)


def holding(question: LiveQuestion, margins: Iterable[LimitMargin]) -> list[str]:
    """Return what a design sits on in words, without limits that are shown and not kept."""
    words = [
        f"{each.of} {'≤' if each.upper else '≥'} {shown_value(each, each.bound)}"
        for each in margins
        if each.active and question.keeps(each.limit)
    ]
    if question.contour not in question.free:
        words.append("the contour, which is held")
    return words


_BEYOND = 5e-4
"""Share of the end by which a strain lies beyond it, from which it is stated."""
_CHANGE = (
    "limit the largest strain, give it more rest length or less pretension, or take a rubber whose law is "
    "stated to hold so far"
)


def smallest(ends: Mapping[str, StrainEnd]) -> float:
    """Return the least strain of several pieces; infinite without any."""
    return min((each.strain for each in ends.values()), default=math.inf)


def stretched_beyond(ends: Mapping[str, StrainEnd], columns: Iterable[LiveColumn]) -> tuple[str, ...]:
    """Return where rubber is stretched beyond what is stated of it, how far, and what to change."""
    angle, *others = columns
    rows = {each.name: each.values for each in others}
    sentences = []
    for name, end in ends.items():
        strains = rows[f"{name}.strain"]
        beyond = strains > end.strain * (1.0 + _BEYOND)
        if np.any(beyond):
            first, last = (math.degrees(angle.values[beyond][k]) for k in (0, -1))
            sentences.append(
                f"{name} is stretched to {100.0 * float(strains.max()):.4g} % between {first:.3g}° and "
                f"{last:.3g}°, but {end.reason}: {_CHANGE}"
            )
    return tuple(sentences)


def declared_strain(model: FlatModel, angles: Array) -> float | None:
    """Return the largest strain of rubber of the machine as it is declared; ``None`` without rubber."""
    law = elastic_law(model)
    if not law.specimens:
        return None
    parameters = model.start(model.parameters)
    extensions = np.array(cam_function(model)(angles.reshape(1, -1), parameters)[1]).ravel()
    stretched = model.values[law.cam.pretension] + extensions
    strains = np.array([np.array(law.function(float(e), parameters)[2]).ravel() for e in stretched])
    return float(strains.max())


ALLOWED = 0.01
"""Rms error over the largest torque above which a design misses its target."""
_BROKEN = 5e-4
"""Share of a bound by which a value lies beyond it that counts as broken, as the page draws it."""
_SI = {"mm": "m", "mm^2": "m^2", "MPa": "Pa", "mN*m": "N*m"}
_MOST_CHECKED = 161
"""Angles at which the torque of a finished assembly is shown."""


def controls_of(question: LiveQuestion, *, can_undo: bool, can_redo: bool) -> LiveControls:
    """Return what a designer can move."""
    behind = {"rubber": question.cam.specimens, "coil": question.cam.coils}
    limits = tuple(
        (name, each.kind.words, each.value, each.kind.unit, each.kind.shown_unit, each.kind.upper,
         each.by_default)
        for name, each in question.limit_values.items()
    )  # fmt: skip
    return LiveControls(
        title=question.title,
        material=question.machine.material,
        points=tuple(tuple(point) for point in question.points),
        limits=limits,
        numbers=tuple(tuple(each) for each in question.numbers.values()),
        contour=question.contour,
        contour_free=question.contour in question.free,
        tasks=tuple(each.row for each in question.tasks),
        stock=tuple(kind for kind, there in behind.items() if there),
        motor=question.motor,
        can_undo=can_undo,
        can_redo=can_redo,
    )


def curve_columns(curves: DesignCurves, targets: Array) -> tuple[LiveColumn, ...]:
    """Return what cam and rubber do over the angle as columns."""
    rows = [
        LiveColumn("angle", "rad", "cam angle", curves.angles),
        LiveColumn("torque", "N*m", "torque of the spring", curves.torques),
        LiveColumn("target", "N*m", "torque that is wanted", targets),
        LiveColumn("error", "N*m", "torque minus target", curves.torques - targets),
        LiveColumn("lever_arm", "m", "lever arm of the cable", curves.lever_arms),
        LiveColumn("stiffness", "N*m/rad", "slope of the torque", curves.stiffnesses),
        LiveColumn("radius_of_curvature", "m", "of the contour under the cable", curves.radii_of_curvature),
        LiveColumn("radius", "m", "distance of the contour from the centre", curves.radii),
        LiveColumn("extension", "m", "of one element, pretension included", curves.extensions),
        LiveColumn("tension", "N", "force of one element and its cable", curves.forces),
    ]
    rows += [LiveColumn(f"{p}.strain", "1", f"nominal strain of {p}", v) for p, v in curves.strains.items()]
    rows += [LiveColumn(f"{p}.stress", "Pa", f"nominal stress of {p}", v) for p, v in curves.stresses.items()]
    return tuple(rows)


def margins_of(states: Iterable[LimitState]) -> tuple[LimitMargin, ...]:
    """Return how a design stands to its limits."""
    return tuple(
        LimitMargin(
            each.limit, each.of, each.value, each.bound,
            each.bound - each.value if each.upper else each.value - each.bound,
            _SI.get(each.unit, each.unit),
            each.unit, each.upper, each.active,
        )
        for each in states
    )  # fmt: skip


def shown_numbers(question: LiveQuestion, values: Mapping[str, float]) -> tuple[NumberState, ...]:
    """Return the numbers of a design."""
    return tuple(n._replace(value=values.get(n.name, n.value)) for n in question.numbers.values())


def view_of(question: LiveQuestion, revision: int, design: CamDesign) -> DesignView:
    """Return what is shown of a finished design: its torque is that of the assembly, flattened anew."""
    check, largest, made = design.check, design.target.largest, design.tolerance
    columns = list(curve_columns(design.curves, design.target.torque(design.curves.angles)))
    every = max(1, len(check.angles) // _MOST_CHECKED)
    at = np.interp
    angles = check.angles[::every]
    columns = [LiveColumn(c.name, c.unit, c.description, at(angles, design.curves.angles, c.values))
               for c in columns]  # fmt: skip
    measured = {"torque": check.torques, "target": check.targets, "error": check.errors}
    columns = [
        LiveColumn(c.name, c.unit, c.description, measured[c.name][::every]) if c.name in measured else c
        for c in columns
    ]
    values = {name: given.number for name, given in design.changes if len(given.values) == 1}
    return DesignView(
        revision=revision,
        checked=True,
        columns=tuple(columns),
        rms_error=design.rms,
        largest_error=check.largest,
        relative_error=design.rms / largest,
        met=design.met,
        margins=margins_of(design.limits),
        active=design.active_limits,
        numbers=shown_numbers(question, values),
        contour=design.contour.points,
        rubber_volume=design.rubber_volume,
        strain_end=smallest(question.machine.strain_ends),
        beyond=stretched_beyond(question.machine.strain_ends, columns),
        made_error=made.quantiles[-1].value if made is not None and made.causes else None,
    )


def quick_view_of(question: LiveQuestion, revision: int, design: ParametricDesign) -> DesignView:
    """Return what is shown of a quick design: its torque is that of the program's nodes."""
    curves, limits, largest = design.curves, design.limits, question.target_size
    columns, ends = curve_columns(curves, design.targets), question.machine.strain_ends
    return DesignView(
        revision=revision,
        checked=False,
        columns=columns,
        rms_error=design.rms,
        largest_error=float(np.max(np.abs(curves.torques - design.targets))),
        relative_error=design.rms / largest,
        met=design.rms <= ALLOWED * largest,
        margins=margins_of(limits),
        active=tuple(dict.fromkeys(state.limit for state in limits if state.active)),
        numbers=shown_numbers(question, design.values),
        contour=design.contour.points,
        rubber_volume=design.rubber_volume,
        strain_end=smallest(ends),
        beyond=stretched_beyond(ends, columns),
    )


def unkept(question: LiveQuestion, margins: Iterable[LimitMargin]) -> tuple[LimitMargin, ...]:
    """Return how a design stands to limits that are shown and not kept: nothing that is free changes them."""
    return tuple(each for each in margins if not question.keeps(each.limit))


def not_kept(question: LiveQuestion, margins: Iterable[LimitMargin]) -> list[str]:
    """Return in words which limits are shown and not kept, and which of them the design breaks."""
    limits = [each for each in question.limit_values.values() if not question.keeps(each.kind.name)]
    titles = " and ".join(f"{each.kind.title} ({each.kind.shown(each.value)})" for each in limits)
    rule = "is shown and not kept" if len(limits) == 1 else "are shown and not kept"
    words = [f"the contour is held, so {titles} {rule}"] if limits else []
    whose = "the cam as it is fitted" if question.held_contour is None else "the contour that is held"
    for each in unkept(question, margins):
        if each.margin < -_BROKEN * abs(each.bound):
            value, bound = (shown_value(each, number) for number in (each.value, each.bound))
            side = "at most" if each.upper else "at least"
            words.append(f"BROKEN by {whose}: {each.of} {value}, {side} {bound} is asked for")
    return words
