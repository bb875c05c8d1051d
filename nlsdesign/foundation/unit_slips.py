"""Units as people write them who have not read how decks write them, and what to write instead."""

from __future__ import annotations

import re

from .errors import UnitError

NOT_SI = {
    "psi": "6.895 kPa for one psi", "bar": "100 kPa for one bar", "atm": "101.325 kPa for one atm",
    "lbf": "4.448 N for one lbf", "lb": "0.4536 kg for one lb", "lbs": "0.4536 kg for one lb",
    "oz": "28.35 g for one oz (a force: 0.278 N)", "ozf": "0.278 N for one ozf", "kgf": "9.807 N for one kgf",
    "kp": "9.807 N for one kp", "in": "25.4 mm for one inch", "inch": "25.4 mm for one inch",
    "ft": "304.8 mm for one foot", "mil": "25.4 um for one mil", "thou": "25.4 um for one thou",
    "C": "temperatures in K: 20 degrees Celsius are 293.15 K", "°C": "temperatures in K: 20 °C are 293.15 K",
    "degC": "temperatures in K: 20 degrees Celsius are 293.15 K", "hr": "'h'", "turn": "'rev'",
    "turns": "'rev'", "hp": "745.7 W for one hp", "percent": "'%'", "ohm": "'Ohm'",
    "L": "1000 cm³ for one litre", "l": "1000 cm³ for one litre", "t": "1000 kg for one tonne",
    "Grad": "'deg'", "grad": "'deg'", "gon": "0.9 deg for one gon", "U": "'rev', or 'rpm' for U/min",
    "qmm": "'mm^2'", "qcm": "'cm^2'", "qm": "'m^2'",
}  # fmt: skip
"""What to write for a symbol that is none of ours; ``Grad`` is no giga-radian."""
_RUN_TOGETHER = re.compile(r"^(?P<head>[GMkcmµun]?(?:N|Pa|g|V|A|W|J|Ohm))(?P<tail>mm|cm|ms|m|s|h|rad)$")


def misspelt_unit(token: str, unit: str, plain: str) -> UnitError | None:
    """Return the error for a symbol that is known and not one of ours, with what to write; else ``None``.

    Examples
    --------
    >>> print(misspelt_unit("kgcm", "kgcm²", "kgcm2"))
    unit 'kgcm²': 'kgcm' stands for a product, which needs its sign -> write 'kg*cm^2'
    """
    if token in NOT_SI:
        return UnitError(
            f"unit '{unit}'", f"'{token}' is not a unit of the SI", next_step=f"write {NOT_SI[token]}"
        )
    match = _RUN_TOGETHER.match(token)
    if match is None:
        return None
    product = f"{match['head']}*{'m*s' if match['tail'] == 'ms' else match['tail']}"
    # The power of the last symbol comes behind it: kgcm2 is kg*cm^2.
    pattern = rf"{re.escape(token)}\^?(-?\d+)?"
    written = re.sub(pattern, lambda power: product + (f"^{power[1]}" if power[1] else ""), plain, count=1)
    rule = f"'{token}' stands for a product, which needs its sign"
    return UnitError(f"unit '{unit}'", rule, next_step=f"write '{written}'")
