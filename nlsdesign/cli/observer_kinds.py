"""The kinds of torque observers that commands offer, and the one that all of them take by default."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import ArrangementError

if TYPE_CHECKING:
    from ..feedback.observer import AdaptiveDesign, GainRule, Grid, ObserverDesign
    from ..model import FlatModel

BEST, CASCADE, CERTIFIED = "best", "cascade", "certified"
KINDS = (BEST, "adaptive", CASCADE, CERTIFIED, "kalman", "published")
kind_option = click.option(
    "--kind",
    type=click.Choice(KINDS),
    default=None,
    help="best: least expected error over the spread of the deck; the default. adaptive: learns what the "
    "deck does not know. cascade: rubber driven by the measured angle, at the declared numbers. certified: "
    "the same structure with one gain that is proved for every angle. kalman: steady-state Kalman filter at "
    "each angle, with noise from the deck's sensors and assumed disturbances. published: states of Austin et "
    "al. 2015, with the gain of the cascade.",
)


@dataclass(frozen=True, eq=False)
class DesignedObserver:
    """An observer as a command writes it.

    Parameters
    ----------
    kind
        Which was designed: not ``best``, but what that turned out to be.
    design
        With table and start values.
    reason
        Why it was taken; empty where it was asked for.
    expected
        Root mean square torque error over the spread, to first order: cascade, and adaptive observer where it
        could be designed; empty where it was asked for.
    """

    kind: str
    design: AdaptiveDesign | ObserverDesign
    reason: str = ""
    expected: tuple[float, ...] = ()

    @property
    def model(self) -> FlatModel:
        """The observer, its description with reason and what is proved of it: here nothing."""
        model = self.design.model
        words = "; ".join(filter(None, (model.description, self.reason, "not certified")))
        return replace(model, description=words)


def designed_observer(
    plant: FlatModel,
    *,
    kind: str | None = None,
    decay: float | None = None,
    sample_time: float = 1e-3,
    spring: str | None = None,
    measured: str | None = None,
    grid: Grid | None = None,
) -> DesignedObserver:
    """Design an observer of the torque of a series spring.

    ``kind``: one of :data:`KINDS`; the first by default. ``decay``: of a certified gain, in 1/s; as fast as
    can be proved by default. ``spring``: path of the spring; decided from the structure if it is left out.
    ``measured``: state that is measured; decided from the structure if it is left out. ``grid``: of its
    table; by the default torque error if it is left out.
    """
    from ..feedback import observer
    from ..model.roles import measured_motion, series_spring

    try:
        torque, measured = series_spring(plant, spring).effort, measured_motion(plant, measured)
    except ArrangementError as error:
        alone = "nlsdesign export fmu --what plant writes the plant alone, with its C sources inside"
        raise ArrangementError(error.thing, error.rule, next_step=f"{error.next_step}; {alone}") from None
    named: dict[str, Any] = {
        "estimate": torque,
        "measured": measured,
        "sample_time": sample_time,
        "grid": grid,
    }
    kind = kind or BEST
    if kind == BEST:
        chosen = observer.choose_observer(plant, **named)
        adaptive = isinstance(chosen.design, observer.AdaptiveDesign)
        return DesignedObserver(
            "adaptive" if adaptive else CASCADE, chosen.design, chosen.reason, chosen.expected
        )
    if kind == "adaptive":
        return DesignedObserver(kind, observer.design_adaptive_observer(plant, **named))
    if kind == "published":
        form = observer.PaperForm()
        return DesignedObserver(kind, observer.design_observer_with_details(plant, form=form, **named))
    gains: dict[str, Callable[[], Any]] = {
        CASCADE: observer.CascadeGain,
        CERTIFIED: lambda: observer.CertifiedGain(decay=decay),
        "kalman": lambda: _kalman(plant, measured, sample_time),
    }
    gain = gains[kind]()
    return DesignedObserver(kind, observer.design_observer_with_details(plant, gain=gain, **named))


def _kalman(plant: FlatModel, measured: str, sample_time: float) -> GainRule:
    """Return the rule with the noise that the deck declares, and that assumed where it declares none."""
    import numpy as np

    from ..feedback.analysis import NoiseAssumptions
    from ..feedback.analysis.kalman import declared_deviation
    from ..feedback.analysis.rest_points import rest_points
    from ..feedback.observer import SteadyStateKalman
    from ..feedback.observer.scheduling.scheduled import whole_contour

    over = whole_contour(plant)
    points = rest_points(plant, np.linspace(over.lower, over.upper, 41), angle=measured)
    process = NoiseAssumptions(sample_time=sample_time).process(points)
    return SteadyStateKalman(process, (declared_deviation(plant, measured),))


def observer_of(
    plant: FlatModel,
    sample_time: float,
    *,
    kind: str | None = None,
    spring: str | None = None,
    measured: str | None = None,
) -> FlatModel:
    """Return the observer of the torque of a series spring; see :func:`designed_observer`.

    ``kind``: one of :data:`KINDS`; the first by default.
    """
    chosen = designed_observer(plant, kind=kind, sample_time=sample_time, spring=spring, measured=measured)
    return chosen.model
