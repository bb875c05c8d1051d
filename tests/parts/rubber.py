"""Rubber with plausible numbers."""

from __future__ import annotations

from nlsdesign.components import (
    ArrheniusShift,
    ExtendedTube,
    FittedRange,
    FlowingChains,
    HeatBalance,
    NeoHooke,
    Ogden,
    OgdenRoxburgh,
    Part,
    PermanentSet,
    QuasilinearRelaxation,
    Rising,
    SelfHeating,
    Springpot,
    StrainStiffening,
    StressSoftening,
    WlfShift,
    Yeoh,
    standard_linear_solid,
)

SOLID = standard_linear_solid(0.92e6, modulus=0.58e6, viscosity=31e3)
DATA = FittedRange(fitted_strain=3.0)
GUM = NeoHooke(shear_modulus=0.39e6)

_PARTS: tuple[Part, ...] = (
    ArrheniusShift(members=(("law", SOLID),), temperature=310.0, reference=293.15, activation=6000.0),
    ExtendedTube(crosslinks=0.1867e6, entanglements=0.2169e6, release=0.2, end=0.09693),
    ExtendedTube(crosslinks=0.1867e6, entanglements=0.2169e6, release=0.2, end=0.09693, data=DATA),
    FlowingChains(shear_modulus=0.1e6, viscosity=0.4e6),
    GUM,
    NeoHooke(shear_modulus=0.39e6, data=DATA),
    Ogden(moduli=(0.618e6, 1.18e3, -9.81e3), exponents=(1.3, 5.0, -2.0)),
    Ogden(moduli=(0.618e6, 1.18e3, -9.81e3), exponents=(1.3, 5.0, -2.0), data=DATA),
    StrainStiffening(modulus=(0.43e6, 0.1e6), knots=(0.0, 1.0), data=DATA),
    PermanentSet(members=(("law", SOLID),), share=0.05, memory=Rising(width=1e-3)),
    QuasilinearRelaxation(members=(("gum", GUM),), shares=(0.2, 0.3), times=(0.02, 0.4)),
    SelfHeating(
        members=(("law", SOLID),), heat=HeatBalance(heat_capacity=1.8e6, cooling=4e4, softening=3e-3)
    ),
    StressSoftening(members=(("law", GUM),), curve=OgdenRoxburgh(strength=1.8, scale=0.12e6)),
    Springpot(modulus=1e6, order=0.1, lower=0.01, upper=100.0),
    WlfShift(members=(("law", SOLID),), temperature=293.15, reference=253.15),
    Yeoh(c1=0.2e6, c2=-1.9e3, c3=45.0),
    Yeoh(c1=0.2e6, c2=-1.9e3, c3=45.0, data=DATA),
)
EXAMPLES: tuple[Part, ...] = _PARTS
