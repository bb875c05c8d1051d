"""What the study of the published actuator returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import nlsdesign as nls
from nlsdesign.bench.discrepancy import Verdict
from nlsdesign.feedback.analysis import Chart

from .._designed import MadeCam
from .evaluation import LoopEvaluation
from .figures import FigureComparison
from .generated import GeneratedCode
from .observer import ObserverComparison
from .spread import ObserverOverSpread, Proved
from .torque_loop import TorqueLoop
from .tracking import Following, tracking_numbers


@dataclass(frozen=True, eq=False)
class ActuatorResults:
    """What follows from one actuator, the published or the designed.

    Parameters
    ----------
    actuator, model
        As declared, and flattened.
    chart
        Observability and stability over the cam angle.
    observers
        Minimal and published form on the bench.
    following
        Closed torque loop on sines of the wanted torque.
    loop
        Generated code and the co-simulated torque loop.
    spread
        Errors of the observers over the spread of the deck, and what is proved, where that was computed.
    evaluation
        Verdicts, margins, impedance and onset of limit cycling of the torque loop, where it was judged.
    """

    actuator: nls.Assembly
    model: nls.FlatModel
    chart: Chart
    observers: ObserverComparison
    following: tuple[Following, ...]
    loop: TorqueLoop
    spread: ObserverOverSpread | None
    evaluation: LoopEvaluation | None

    @property
    def generated(self) -> nls.FlatModel:
        """The observer that is generated: with the least error over the spread, else the cascade."""
        return self.spread.chosen.model if self.spread is not None else self.observers.minimal.model

    @property
    def rank_at_zero(self) -> float:
        """Rank of the observability matrix at angle zero."""
        return float(self.chart["observability.rank"][len(self.chart.at) // 2])

    def followed(self, proportional: float, frequency: float) -> Following:
        """Return the run of the torque loop with a gain at a frequency in Hz."""
        return next(r for r in self.following if (r.proportional, r.frequency) == (proportional, frequency))

    @property
    def judged(self) -> dict[str, float]:
        """What is expected, proved, co-simulated and judged; nothing of what the fast way leaves out."""
        numbers = self.loop.numbers
        if self.spread is not None:
            proof, expected = self.spread.proved.certificate.proof, self.spread.chosen.expected
            numbers |= {
                "expected_over_spread_cascade_mNm_rms": 1e3 * expected[0],
                "expected_over_spread_best_mNm_rms": 1e3 * min(expected),
                "certified_decay_per_s": proof.decay,
                "certified_condition": proof.condition,
            }
        if self.evaluation is not None:
            numbers["onset_of_limit_cycling_Kp"] = self.evaluation.onset.value
            if (margins := self.evaluation.spread) is not None:
                numbers |= {
                    "largest_Kp_with_margins": margins.enough,
                    "limit_cycling_after_kick_Kp_32_percent": 100.0 * margins.cycling,
                }
        return numbers


@dataclass(frozen=True, eq=False)
class Results:
    """Results of all steps.

    Parameters
    ----------
    published, designed
        The published actuator, and the one with the designed spring in its place.
    cam
        Cam, pretension and rubber for the torque curve of 2014, and the part as it is made.
    figures
        Published actuator against the figures of the paper.
    verdict
        Of the diagnosis of the bench records of the published actuator.
    generated
        The diagnosed actuator: its code, and how it runs under code from the other decks.
    """

    published: ActuatorResults
    designed: ActuatorResults
    cam: MadeCam
    figures: FigureComparison
    verdict: Verdict
    generated: GeneratedCode

    @property
    def both(self) -> dict[str, ActuatorResults]:
        """Both actuators by name."""
        return {"published": self.published, "designed": self.designed}

    @property
    def proved(self) -> dict[str, Proved]:
        """What is proved of each actuator, by its name."""
        return {name: each.proved for name, each in self.over_spread.items()}

    @property
    def over_spread(self) -> dict[str, ObserverOverSpread]:
        """Observers over the spread, by the name of the actuator: of the designed one the whole way only."""
        return {name: each.spread for name, each in self.both.items() if each.spread is not None}

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers, by name with unit."""
        figures, tolerance, curves = self.figures, self.cam.tolerance, self.cam.design.curves
        numbers = {
            "design_torque_error_mNm_rms": 1e3 * self.cam.design.rms,
            "design_cable_force_N": float(np.max(curves.forces)),
            "design_quantile_mNm_rms": 1e3 * tolerance.quantiles[-1].value,
            "design_quantile_after_trim_mNm_rms": 1e3 * tolerance.trims[0].quantiles[-1].value,
            "fig8_rms_error_Nm": figures.agreement.rmse,
            "fig8_mean_relative_error_percent": figures.agreement.relative,
            "fig8_hooke_mean_relative_error_percent": figures.hooke_agreement.relative,
            "fig1_loop_area_model_over_paper": figures.loops["45°"].area_ratio,
            "verdict_held_out_error_over_noise": self.verdict.held_out_ratio,
        }
        for name, each in self.both.items():
            numbers |= {
                f"{name}_rank_at_zero": each.rank_at_zero,
                f"{name}_nominal_error_minimal_form_mNm_rms": 1e3 * each.observers.minimal_error,
                f"{name}_nominal_error_published_form_mNm_rms": 1e3 * each.observers.published_error,
                f"{name}_error_with_stiffer_rubber_mNm_rms": 1e3 * each.observers.stiffer_error,
                **{f"{name}_{what}": number for what, number in each.judged.items()},
            }
        numbers |= self.generated.numbers
        return numbers | tracking_numbers({name: each.following for name, each in self.both.items()})
