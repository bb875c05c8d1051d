"""Which rubber: the spring designed anew for every rubber of the library, ranked in the torque loop.

Cam, pretension and sizes of the rubber are designed for the torque curve of the published actuator, with the
same limits; observer and gain follow by one rule each. The loss of a rubber is known as a range, its modulus
scatters: over both stand the probabilities that an order holds. Then one spring with more and more loss shows
what an observer can cure and what it cannot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nlsdesign.components import material

from .candidates import candidates
from .hysteresis import LOSSES, Hysteresis, hysteresis
from .merits import HIGH, Merits, merits_of
from .ranking import PUBLISHED, Ranking, rankings
from .report import write

IN_FAST = ("natural_rubber_treloar",)
_SIZE = HIGH / np.sqrt(2.0)


@dataclass(frozen=True, eq=False)
class Results:
    """Figures of merit of each rubber, rankings by name of the figure, and errors over the loss."""

    merits: tuple[Merits, ...]
    rankings: dict[str, Ranking]
    hysteresis: Hysteresis

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers, by name with unit."""
        numbers = {"missed": float(sum(not m.met for m in self.merits))}
        for m in self.merits:
            if m.met:
                name = m.candidate.name
                numbers |= {f"{name}_gain": m.proportional} | {
                    f"{name}_{key}": float(m.values[metric][1, 1]) for metric, key in _SHOWN.items()
                }
                ends = m.values["estimate_error"][[0, 2], 1]
                numbers[f"{name}_worst_estimate_percent"] = float(np.max(ends)) / (10.0 * _SIZE)
        errors = [abs(e) for m in self.merits for n, e in m.between.items() if n != "estimate_error"]
        numbers["between_points_percent"] = 100.0 * max(errors)
        for metric, ranking in self.rankings.items():
            numbers[f"first_two_{metric}"] = ranking.first_two
        h = self.hysteresis
        at = list(h.loss_tangents).index(0.1)
        numbers |= {
            f"estimate_{kind}_at_0.1_percent": 100.0 * float(h.estimate[kind][at]) for kind in h.estimate
        }
        numbers |= {f"threshold_{kind}": h.threshold(kind) for kind in ("static", "wrong")}
        numbers["estimate_exact_at_most_percent"] = 100.0 * float(np.max(h.estimate["exact"]))
        numbers["lost_at_0.1_percent"] = 100.0 * float(h.lost["exact"][at])
        return {name: value for name, value in numbers.items() if np.isfinite(value)}


_SHOWN = {
    "bandwidth_low": "bandwidth_low_Hz",
    "bandwidth_high": "bandwidth_high_Hz",
    "impedance": "impedance_Nm_per_rad",
    "loss": "loss_mJ",
    "volume": "rubber_cm3",
}


def main(out: Path, fast: bool = False) -> Results:
    """Design and rank all rubbers, run the published one with more and more loss, and write a report."""
    chosen = [c for c in candidates() if not fast or c.name in IN_FAST]
    merits = tuple(merits_of(each) for each in chosen)
    losses: Sequence[float] = (0.1,) if fast else LOSSES
    results = Results(merits, rankings(merits), hysteresis(material(PUBLISHED), losses))
    write(out, results.merits, results.rankings, results.hysteresis)
    return results
