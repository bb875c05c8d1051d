"""Rubber with plausible numbers."""

from __future__ import annotations

from nlsdesign.components import ExtendedTube, NeoHooke, Ogden, Part, Springpot, Yeoh

_PARTS: tuple[Part, ...] = (
    ExtendedTube(crosslinks=0.1867e6, entanglements=0.2169e6, release=0.2, end=0.09693),
    NeoHooke(shear_modulus=0.39e6),
    Ogden(moduli=(0.618e6, 1.18e3, -9.81e3), exponents=(1.3, 5.0, -2.0)),
    Springpot(modulus=1e6, order=0.1, lower=0.01, upper=100.0),
    Yeoh(c1=0.2e6, c2=-1.9e3, c3=45.0),
)
EXAMPLES: dict[type[Part], Part] = {type(part): part for part in _PARTS}
