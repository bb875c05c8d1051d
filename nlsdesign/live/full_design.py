"""The whole design of a question: several starts, the finish, the check on the finished assembly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from ..components.assembly.named_parts import Assembly
from ..design import CamDesign, Contour, DesignSettings, Limit, Target, design_cam
from ..design.parametric.parametric_solver import ParametricDesign
from ..foundation.errors import ConvergenceError, InfeasibleError
from ..foundation.written_numbers import prefixed
from .answers import DesignView, LiveAnswer
from .at_angle import AngleView
from .limit_words import in_words
from .question import LiveQuestion
from .views import not_kept, unkept, view_of

STARTS = 12
_DEARER = 1e-3
"""Relative difference of costs, and cost, from which two solutions are different optima."""
_WEIGHED = " (torque error, rubber and smoothness together)"
_DIFFERS = 1e-3
"""Difference of two rms errors relative to the largest torque from which it is stated."""


@dataclass(frozen=True, eq=False)
class FullDesign:
    """What the whole design came to."""

    state: str
    design: CamDesign | None
    message: str = ""


def whole_design(
    stage: Callable[[str], None],
    actuator: Assembly,
    target: Target,
    free: tuple[str, ...],
    keep: tuple[Limit, ...],
    contour: Contour | None = None,
) -> FullDesign:
    """Return the whole design.

    ``actuator``, ``target``, ``free``, ``keep``: as for :func:`~nlsdesign.design.design_cam`; the limits are
    all that hold.
    """
    done = 0

    def progress() -> None:
        nonlocal done
        done += 1
        stage(f"start {done} is solved, of {STARTS} at most; then the finish, and what would help")

    stage(f"solves from {STARTS} starts at most, until the best was found twice")
    settings = DesignSettings(
        starts=STARTS, defaults=(), look_for_size_ranges=False, draws=0, progress=progress,
        contour=contour,
    )  # fmt: skip
    try:
        return FullDesign(
            "solved", design_cam(actuator, target=target, free=free, keep=keep, settings=settings)
        )
    except InfeasibleError as error:
        return FullDesign("infeasible", None, str(error))
    except ConvergenceError as error:
        return FullDesign("not solved", None, str(error))


def full_answer(
    full: FullDesign, question: LiveQuestion, quick: LiveAnswer, solved: ParametricDesign | None
) -> LiveAnswer:
    """Return the answer that replaces the quick one, with what differs between the two in its message.

    ``solved``: its design; ``None`` where it had none of its own.
    """
    limits = question.limit_values
    if full.design is None and solved is None:
        return replace(quick, state=full.state, source="full", message=in_words(full.message, limits))
    if full.design is None:
        reason = in_words(full.message, limits)
        sentence = f"the whole design came to no answer: {reason}; shown is the quick answer, unchecked"
        return replace(quick, source="full", message=sentence)
    view = view_of(question, quick.revision, full.design)
    missed = full.design.miss
    sentences = [*view.beyond, *([] if missed is None else [f"misses its target: {missed.words}"])]
    if missed is not None and missed.advice:
        sentences.append(f"what would help: {', or '.join(missed.advice)}")
    if solved is not None and quick.design is not None:
        sentences += _differences(full.design, solved, quick.design)
    elif quick.state != "solved":
        sentences.append("the quick answer had no design for this question")
    if quick.state == "solved" and quick.design is not None:
        # The whole search knows nothing of limits that nothing can change; they are shown all the same.
        view = replace(view, margins=(*view.margins, *unkept(question, quick.design.margins)))
    sentences += not_kept(question, view.margins)
    sentences += full.design.remarks
    message = in_words("; ".join(sentences), limits)
    return replace(quick, state="solved", source="full", message=message, design=view, conflicts=())


def _differences(design: CamDesign, solved: ParametricDesign, quick: DesignView) -> list[str]:
    """Return in words where the quick answer was another optimum, or the finished assembly is another."""
    cost, largest, sentences = design.starts[design.taken].cost, design.target.largest, []
    was, there = (f"{prefixed(each)} rms" for each in (quick.rms_error, design.predicted_rms))
    if solved.cost > cost * (1.0 + _DEARER) + _DEARER:
        sentences.append(
            f"the quick answer was a worse local optimum{_WEIGHED}: {was} against {there} now, both "
            "before the finish"
        )
    elif cost > solved.cost * (1.0 + _DEARER) + _DEARER:
        sentences.append(
            f"the quick answer was a better local optimum{_WEIGHED} that none of {len(design.starts)} starts "
            f"reaches: {was} against {there} now; undo and redo bring it back"
        )
    if abs(design.rms - quick.rms_error) > _DIFFERS * largest:
        sentences.append(
            f"the finished assembly gives {prefixed(design.rms)} rms where the quick answer gave "
            f"{prefixed(quick.rms_error)}: its cam sets in over an angle, and knots of its rubber are "
            "sharp"
        )
    return sentences


def angle_view_of(view: DesignView, design: CamDesign, question: LiveQuestion) -> AngleView:
    """Return a finished design as it is looked at angle by angle."""
    return AngleView(view, design.contour, question.cam, lambda: design.actuator)
