"""Elementary functions of our own in C: the same bits on every processor with IEEE arithmetic.

Libraries of mathematics differ in the last digit, and not every controller has one. These functions use sums,
products, quotients and comparisons alone, and of ``math.h`` what has only one right answer: ``fabs``,
``copysign``, ``floor``, ``fmod`` and ``sqrt``. So the code on the controller and its FMU on the desk give the
same bits, provided the compiler forms no fused multiply-add (``-ffp-contract=off``). Their errors, in units
of the last place, stand at each function in the template ``elementary.c``; tests hold them.

Arguments are reduced as in Cody and Waite 1980 (Software Manual for the Elementary Functions): constants such
as ln 2 stand in several parts, whose products with a small integer are exact.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import lru_cache
from types import MappingProxyType

from ..files import filled, template
from .c_text import Real

_LN2 = Fraction("0.693147180559945309417232121458176568075500134360255254120680009493")
_PI = Fraction("3.141592653589793238462643383279502884197169399375105820974944592308")

# Minimax polynomials from the lowest power, by Remez's algorithm in 80 digits; the variables are r of the
# range-reduced exp, t = 1/(1 + x/2) of erfc, and the square of the reduced argument of the others.
_POLYNOMIALS: Mapping[str, Mapping[str, tuple[float, ...]]] = MappingProxyType(
    {
        "float": {
            "exp": (0.5, 0.16666506, 0.041666165, 0.008370322, 0.0013953072),
            "log": (0.6666678, 0.39976612, 0.2989864),
            "sin": (-0.16666654, 0.008332131, -0.00019510838),
            "cos": (0.041666646, -0.0013887306, 2.4431216e-05),
            "atan": (-0.33333313, 0.19998434, -0.14242743, 0.10587368, -0.060605384),
            "erf": (
                0.12837917,
                -0.37612635,
                0.11283716,
                -0.026860502,
                0.005203773,
                -0.0008173951,
                8.503178e-05,
            ),
            "erfc": (0.2782154, 0.31877533, 0.11015918, 0.41778484, -0.08505846, -0.040269632),
        },
        "double": {
            "exp": (
                0.5000000000000016,
                0.16666666666666707,
                0.04166666666648961,
                0.008333333333302679,
                0.0013888888954309993,
                0.00019841269927075347,
                2.480148195553756e-05,
                2.755720774317938e-06,
                2.7634255816265273e-07,
                2.5120538967661165e-08,
            ),
            "log": (
                0.6666666666666745,
                0.3999999999933936,
                0.28571428760591283,
                0.22222196570424957,
                0.18183674817756929,
                0.15311072466271586,
                0.14827151894299326,
            ),
            "sin": (
                -0.16666666666666627,
                0.008333333333321286,
                -0.00019841269828869973,
                2.755731335593755e-06,
                -2.5050704025690396e-08,
                1.5893583043626737e-10,
            ),
            "cos": (
                0.04166666666666659,
                -0.0013888888888872598,
                2.4801587288491735e-05,
                -2.7557314056471515e-07,
                2.0875681864901776e-09,
                -1.135744788532356e-11,
            ),
            "atan": (
                -0.33333333333333187,
                0.19999999999949722,
                -0.14285714279788264,
                0.11111110762214332,
                -0.09090897125541068,
                0.07692048629475129,
                -0.06662968845002004,
                0.0584688213919181,
                -0.050346697099945076,
                0.03794453023552133,
                -0.017773465532766465,
            ),
            "erf": (
                0.1283791670955126,
                -0.37612638903183726,
                0.11283791670953656,
                -0.026866170644794955,
                0.0052239776214639405,
                -0.0008548326745547864,
                0.00012055320658215756,
                -1.4925289811546664e-05,
                1.6455051255515453e-06,
                -1.627383871202377e-07,
                1.403681509576396e-08,
                -8.459535003527343e-10,
            ),
            "erfc": (
                0.28211676223852217,
                0.2815737564501295,
                0.25247668888764185,
                0.13945800468203365,
                0.24476493800375945,
                -0.49751328606951384,
                1.0170903761625396,
                -1.6952498183302138,
                1.6720953073254554,
                -0.9534357423603298,
                0.29211158576248203,
                -0.03346852869335642,
                -0.0020204852224740733,
            ),
        },
    }
)
_VARIABLE = {"exp": "r", "erfc": "t"}


@lru_cache(maxsize=1)
def own_functions() -> frozenset[str]:
    """Return the names of the functions of ``math.h`` that ours replace."""
    return frozenset(re.findall(r"^static .* portable_(\w+)@f@\(", template("elementary.c"), re.MULTILINE))


def elementary_functions(real: Real, lines: Iterable[str]) -> list[str]:
    """Return the definitions that C statements need, each after those that it needs itself."""
    head, definitions = _definitions(real)
    needed = _called("\n".join(lines), real)
    for name in reversed(list(definitions)):
        if name in needed:
            needed |= _called(definitions[name], real)
    parts = [head] * bool(needed) + [text for name, text in definitions.items() if name in needed]
    return [line for part in parts for line in (*part.split("\n"), "")]


def _called(text: str, real: Real) -> set[str]:
    return set(re.findall(rf"\bportable_(\w+?){real.suffix}\(", text))


@lru_cache(maxsize=2)
def _definitions(real: Real) -> tuple[str, Mapping[str, str]]:
    """Return the head of the template, and the text of each function, each defined before it is used."""
    single = real is Real.FLOAT
    numbers = {
        "real": real,
        "f": real.suffix,
        "word": "uint32_t" if single else "uint64_t",
        **{key: str(number) for key, number in _integers(single).items()},
        **{key: real.literal(number) for key, number in _reals(real).items()},
    }
    for key, polynomial in _POLYNOMIALS[real].items():
        # Horner's scheme
        text, variable = real.literal(polynomial[-1]), _VARIABLE.get(key, "z")
        for number in reversed(polynomial[:-1]):
            text = f"{real.literal(number)} + {variable} * ({text})"
        numbers[f"polynomial_{key}"] = text
    head, *parts = [part.strip("\n") for part in re.split(r"\n\n(?=/\*)", filled("elementary.c", numbers))]
    heads = [re.search(rf"^static \w+ portable_(\w+?){real.suffix}\(", part, re.MULTILINE) for part in parts]
    return head, MappingProxyType({one[1]: part for one, part in zip(heads, parts, strict=True) if one})


def _format(single: bool) -> tuple[int, int, float]:
    """Return binary digits and bias of a format, and the number that shifts digits behind the point out."""
    digits, bias = (23, 127) if single else (52, 1023)
    return digits, bias, 1.5 * 2.0**digits


def _integers(single: bool) -> dict[str, int]:
    """Return the whole numbers of the template."""
    digits, bias, shift = _format(single)
    return {
        "digits": digits,
        "shift_less_two_biases": _bits(shift, single) - 2 * bias,
        "shift_less_bias_below": _bits(shift, single) - (bias - 1),
        "one_bits": _bits(1.0, single),
        "root_half_bits": _bits(math.sqrt(0.5), single),
        "fraction_mask": 2**digits - 1,
    }


def _reals(real: Real) -> dict[str, float]:
    """Return the floating-point numbers of the template."""
    single = real is Real.FLOAT
    digits, bias, shift = _format(single)
    ln2 = _parts(_LN2, 15 if single else 41, parts=2)
    half_pi = _parts(_PI / 2, 12 if single else 32, parts=4)
    pi = _parts(_PI, digits + 1, parts=2)
    return {
        "zero": 0.0,
        "bias": float(bias),
        "half": 0.5,
        "one": 1.0,
        "two": 2.0,
        "largest": real.largest,
        "shift": shift,
        "per_ln2": float(1 / _LN2),
        "ln2": float(_LN2),
        "ln2_high": ln2[0],
        "ln2_low": ln2[1],
        "exp_lowest": -104.0 if single else -746.0,
        "exp_highest": 89.0 if single else 710.0,
        "expm1_lowest": -18.0 if single else -38.0,
        "exp_large": 88.0 if single else 709.0,
        "tanh_one": 10.0 if single else 20.0,
        "least_normal": 2.0 ** (1 - bias),
        "denormal_scale": 2.0 ** (digits + 2),
        "denormal_power": float(digits + 2),
        "log1p_direct_below": -0.2928,
        "log1p_direct_above": 0.4142,
        "square_limit": 2.0 ** ((digits + 5) // 2),
        "circle_limit": 3000.0 if single else 1e6,
        "per_half_pi": float(2 / _PI),
        "two_pi": float(2 * _PI),
        **{f"half_pi_{i + 1}": part for i, part in enumerate(half_pi)},
        "tan_eighth": 0.41421356,
        "pi": pi[0],
        "pi_low": pi[1],
        "half_pi": pi[0] / 2,
        "half_pi_low": pi[1] / 2,
        "quarter_pi": pi[0] / 4,
        "quarter_pi_low": pi[1] / 4,
        "erf_near": 0.9,
        "erf_one": 4.1 if single else 6.1,
    }


def _bits(value: float, single: bool) -> int:
    return int.from_bytes(struct.pack("<f" if single else "<d", value), "little")


def _parts(number: Fraction, bits: int, *, parts: int) -> list[float]:
    """Return positive numbers of few bits that add up to one of many; the last has all bits."""
    split: list[float] = []
    for _ in range(parts - 1):
        unit = Fraction(2) ** (math.frexp(float(number))[1] - bits)
        split.append(float(math.floor(number / unit) * unit))
        number -= Fraction(split[-1])
    return [*split, float(number)]
