"""Networks with a name, built from springs and dashpots of a material; each is a plain arrangement.

The members keep their standard names, so that a deck that declares the same arrangement has the same names.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from ...foundation.errors import ValueRangeError
from ...foundation.quantity import Quantity
from ..core.element import Element, Parallel, parallel
from ..core.series import Series, series
from ..core.springs import LinearElastic, ViscousMaterial

Number: TypeAlias = Quantity | float


def kelvin_voigt(*, modulus: Number, viscosity: Number) -> Parallel:
    """Spring and dashpot in parallel: E* = E + s·η; creeps to σ/E with the time constant η/E.

    Valid for slow, damped motion: at high frequency it is rigid. Source: Kelvin 1865, Voigt 1892.

    Parameters
    ----------
    modulus, viscosity
        E in Pa and η in Pa·s.

    Examples
    --------
    >>> [name for name, _ in kelvin_voigt(modulus=1e6, viscosity=3e4).members]
    ['spring', 'dashpot']
    """
    return parallel(spring=_elastic(modulus), dashpot=_viscous(viscosity))


def maxwell(*, modulus: Number, viscosity: Number) -> Series:
    """Spring and dashpot in series: E* = s·η·E/(E + s·η); relaxes to nothing with the time constant η/E.

    Valid for a flowing material or as a branch of one that does not flow. Source: Maxwell 1867.

    Parameters
    ----------
    modulus, viscosity
        E in Pa and η in Pa·s.

    Examples
    --------
    >>> [name for name, _ in maxwell(modulus=1e6, viscosity=3e4).members]
    ['spring', 'dashpot']
    """
    return series(spring=_elastic(modulus), dashpot=_viscous(viscosity))


def standard_linear_solid(equilibrium: Element | Number, *, modulus: Number, viscosity: Number) -> Parallel:
    """Equilibrium law ``stiff`` parallel to a Maxwell branch ``relaxing``: E* = E∞ + s·η·E/(E + s·η).

    The loss tangent has one peak, at ω = (E/η)·√(E∞/(E∞ + E)), and falls with the frequency ratio to either
    side; that of rubber hardly changes over decades.
    With :class:`StrainStiffening` as equilibrium law it is the law of the
    published actuator. Sources: Zener 1948; Austin et al. 2015, eq. (1).

    Parameters
    ----------
    equilibrium
        Modulus in Pa, or any law of stress and strain.
    modulus, viscosity
        Of the branch, in Pa and Pa·s.

    Examples
    --------
    >>> [name for name, _ in standard_linear_solid(0.9e6, modulus=0.6e6, viscosity=3e4).members]
    ['stiff', 'relaxing']
    """
    return parallel(stiff=_law(equilibrium), relaxing=maxwell(modulus=modulus, viscosity=viscosity))


def burgers(*, modulus: Number, flow: Number, delayed_modulus: Number, delayed_viscosity: Number) -> Series:
    """Maxwell and Kelvin–Voigt in series: 1/E* = 1/E + 1/(s·η_f) + 1/(E_d + s·η_d).

    Creep under constant stress has a jump σ/E, a delayed part with the time constant η_d/E_d, and a flow
    σ·t/η_f without end. Source: Burgers 1935.

    Parameters
    ----------
    modulus
        E in Pa.
    flow
        Viscosity η_f of the lasting flow in Pa·s.
    delayed_modulus, delayed_viscosity
        E_d in Pa and η_d in Pa·s of the part that comes back.

    Examples
    --------
    >>> made = burgers(modulus=1e6, flow=1e9, delayed_modulus=2e6, delayed_viscosity=1e5)
    >>> [name for name, _ in made.members]
    ['spring', 'flow', 'delayed']
    """
    delayed = kelvin_voigt(modulus=delayed_modulus, viscosity=delayed_viscosity)
    return series(spring=_elastic(modulus), flow=_viscous(flow), delayed=delayed)


def generalised_maxwell(
    equilibrium: Element | Number, *, moduli: Sequence[float], times: Sequence[float]
) -> Parallel:
    """Equilibrium law ``stiff`` parallel to Maxwell branches: E* = E∞ + Σ Eᵢ·s·τᵢ/(1 + s·τᵢ), a Prony series.

    Valid from the reciprocal of the longest to that of the shortest relaxation time. Sources: Wiechert 1893;
    Tschoegl 1989.

    Parameters
    ----------
    equilibrium
        Modulus in Pa, or any law of stress and strain.
    moduli
        Eᵢ in Pa, shape (n,); the branches are ``relaxing_1``, ``relaxing_2`` and so on.
    times
        Relaxation times τᵢ in s, shape (n,).

    Raises
    ------
    ValueRangeError
        If there is not one relaxation time per modulus.

    Examples
    --------
    >>> made = generalised_maxwell(1e6, moduli=(2e5, 1e5), times=(0.01, 0.1))
    >>> [name for name, _ in made.members]
    ['stiff', 'relaxing_1', 'relaxing_2']
    """
    if len(moduli) != len(times):
        raise ValueRangeError(
            f"moduli ({len(moduli)}) and times ({len(times)})",
            "there must be one relaxation time per modulus",
        )
    branches = {
        f"relaxing_{i}": maxwell(modulus=modulus, viscosity=modulus * time)
        for i, (modulus, time) in enumerate(zip(moduli, times, strict=True), start=1)
    }
    return parallel(stiff=_law(equilibrium), **branches)


# A part turns bare numbers into quantities where it is made.
def _elastic(modulus: Number) -> LinearElastic:
    return LinearElastic(modulus=modulus)  # type: ignore[arg-type]


def _viscous(viscosity: Number) -> ViscousMaterial:
    return ViscousMaterial(viscosity=viscosity)  # type: ignore[arg-type]


def _law(equilibrium: Element | Number) -> Element:
    return equilibrium if isinstance(equilibrium, Element) else _elastic(equilibrium)
