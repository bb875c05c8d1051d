"""The torque loop of the published actuator: Figs 8, 9 and 10 beside the published points, cause by cause.

Austin, Schepelmann, Geyer, "Control and Evaluation of Series Elastic Actuators with Nonlinear Rubber
Springs", IROS 2015. The paper prints neither gains nor the amplitude of the load of Fig. 9: those used here
are assumed, and each statement is decided by switching one cause off, or adding one, at a time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .._published import figure_points
from . import statements as stated
from .benches import DECKS, NONLINEAR, SOFT, STIFF
from .felt_torque import FeltTorque, felt_torque
from .followed_torque import (
    GENTLE,
    LATE_TORQUE,
    FollowedTorque,
    followed_torque,
)
from .report import write_page
from .scheduled_law import ScheduledLaw, scheduled_law
from .statement import Statement

DRAWS, FEW_DRAWS = 100, 8


@dataclass(frozen=True, eq=False)
class Results:
    """What was simulated, and what becomes of each published statement.

    Parameters
    ----------
    felt
        Fig. 9.
    followed
        Fig. 10.
    law
        The law that commands speed by tangent stiffness.
    statements
        In the order of the figures.
    decided
        Numbers of the statements by name.
    """

    felt: FeltTorque
    followed: FollowedTorque
    law: ScheduledLaw
    statements: tuple[Statement, ...]
    decided: Mapping[str, float]

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers by name."""
        late_phase = {
            f"phase_error_{s}_torque_6_ms_late_deg": self._phase_error(LATE_TORQUE.name, s) for s in DECKS
        }
        prompt_phase = {f"phase_error_{s}_deg": self._phase_error(GENTLE.name, s) for s in DECKS}
        return {
            **{f"fig9_to_2_Hz_{s}_percent": 100.0 * self.felt.deviation(s, late=False, up_to=2.0)
               for s in DECKS},
            **{f"fig9_to_9_Hz_{s}_torque_8_ms_late_percent":
               100.0 * self.felt.deviation(s, late=True, up_to=9.1) for s in (SOFT, STIFF)},
            "fig9_at_11_Hz_mNm": 1e3 * float(self.felt.prompt[NONLINEAR].rms[-1]),
            **late_phase,
            **prompt_phase,
            **self.decided,
            **{f"scheduled_error_at_{f:g}_Hz": e for f, (e, _) in self.law.errors.items()},
            "scheduled_share_of_held_draws_that_settle": self.law.held,
        }  # fmt: skip

    def _phase_error(self, setting: str, spring: str) -> float:
        return self.followed[setting, "low", spring].deviation[1]


def main(out: Path, fast: bool = False, draws: int = DRAWS) -> Results:
    """Simulate all figures, decide all statements, and write ``report.html`` with its figures."""
    points = figure_points("fig08_torque_profile_nls")
    error = stated.static_torque(NONLINEAR, points[:, 0]) - points[:, 1]
    fig8 = float(np.sqrt(np.mean(error**2)))
    felt, followed = felt_torque(fast=fast), followed_torque(fast=fast)
    lower, numbers = stated.impedance(felt)
    alike, more = stated.like_a_linear_spring(followed)
    rest = (
        stated.overshoot(fast=fast), stated.instability(fast=fast), stated.gentle_integral(), stated.margins()
    )  # fmt: skip
    decided = {"fig8_rms_error_Nm": fig8, **numbers, **more}
    for _, each in rest:
        decided |= each
    statements = (stated.torque_curve(fig8), *lower, *alike, *(statement for statement, _ in rest))
    law = scheduled_law(min(draws, FEW_DRAWS) if fast else draws)
    results = Results(felt, followed, law, statements, decided)
    write_page(out, felt, followed, law=law, statements=statements)
    return results
