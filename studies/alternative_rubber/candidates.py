"""The rubbers that are compared, and the spring that is designed anew for each."""

from __future__ import annotations

from dataclasses import dataclass, replace

import nlsdesign as nls
from nlsdesign.components import KnownLoss, Material, flat_relaxation, loss_of, materials, relaxing_law_of
from nlsdesign.design import AreaRange, CamDesign, DesignSettings, Target
from nlsdesign.foundation.errors import ArrangementError

from .._designed import with_machined_contour
from .._published import declared_actuator
from ..austin2015.design import ANCHOR, FREE, LARGEST_RADIUS, LENGTHS

TARGET = nls.ExponentialTorque(maximum=5.0, angle=nls.degrees(53.0), shape=1.0)
"""Schepelmann, Geberth and Geyer, ICRA 2014, as in the study of the published actuator."""
AREA = (1e-5, 4e-4)
"""Section in m²; assumed: more than 4 cm² has no room beside the cam, and is no strip any more."""
BRANCHES = 4
"""Of every relaxation: the loss tangent then keeps within 5 % from 0.1 to 10 Hz, up to 0.5."""
STANDS_IN = "natural_rubber_treloar"
"""Whose elastic curve is taken where the library has none for a kind of rubber."""
SPREAD = 0.15
"""Of the modulus where the library gives none; assumed: as PMC-770 scatters from sample to sample."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A rubber with an elastic curve and what is known of its loss.

    Parameters
    ----------
    name
        In the library.
    elastic
        Whose elastic law is taken: its own, or that of the rubber that stands in for it.
    loss
        Of the rubber or its family.
    spread
        Standard deviation of the factor of the modulus.
    """

    name: str
    elastic: Material
    loss: KnownLoss
    spread: float

    @property
    def own_curve(self) -> bool:
        """Whether the elastic curve is that of the rubber itself."""
        return self.elastic.name == self.name

    @property
    def label(self) -> str:
        """Name for people; a star where the elastic curve is another one's."""
        return self.name.replace("_", " ") + ("" if self.own_curve else " *")


def candidates() -> list[Candidate]:
    """Return every rubber of the library whose loss is known, itself or by its family.

    A family that is in the library with a grade of its own is left out, for the grade stands for it.
    """
    known = materials()
    graded = {m.family for m in known.values() if _has_curve(m)}
    made = []
    for name, rubber in known.items():
        if not _has_curve(rubber) and rubber.family in graded:
            continue
        elastic = rubber if _has_curve(rubber) else known[STANDS_IN]
        curves = [p.quantity for p in elastic.properties if p.name.startswith("nominal_stress")]
        spreads = [each.spread.share(each.values[-1]) for each in curves]
        made.append(Candidate(name, elastic, loss_of(rubber), max([*spreads, 0.0]) or SPREAD))
    return made


def _has_curve(rubber: Material) -> bool:
    try:
        relaxing_law_of(rubber, loss_tangent=0.1)
    except ArrangementError:
        # No elastic law is known of it; that is what is asked.
        return False
    return True


def with_loss(actuator: nls.Assembly, elastic: Material, loss_tangent: float) -> nls.Assembly:
    """Return the actuator with a rubber that has a loss tangent from 0.1 to 10 Hz."""
    relaxation = flat_relaxation(loss_tangent, branches=BRANCHES)
    return nls.with_rubber(actuator, elastic, loss_tangent=relaxation)


def designed(elastic: Material, loss_tangent: float, target: Target = TARGET) -> CamDesign:
    """Return cam, pretension and rubber for a target; the loss does not enter, for the law is static."""
    actuator = with_loss(with_machined_contour(declared_actuator(), ANCHOR), elastic, loss_tangent)
    return nls.design_cam(
        actuator,
        target=target,
        free=FREE,
        keep=[nls.MaximumCamRadius(LARGEST_RADIUS), nls.RestLengthRange(*LENGTHS), AreaRange(*AREA)],
        settings=DesignSettings(draws=0, look_for_size_ranges=False, look_for_remedies=False, starts=4),
    )


def without_loss(actuator: nls.Assembly) -> nls.Assembly:
    """Return the actuator as its static torque curve has it: no relaxation."""
    shares = actuator.quantities()["spring.rubber.relaxing.shares"]
    none = replace(shares, value=(0.0,) * len(shares.values), source="static curve: no relaxation")
    return actuator.with_values({"spring.rubber.relaxing.shares": none})
