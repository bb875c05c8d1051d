"""What the study of the published actuator returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import nlsdesign as nls
from nlsdesign.analysis import Chart
from nlsdesign.design import CamDesign
from nlsdesign.discrepancy import Verdict

from .figures import FigureComparison
from .observer import ObserverComparison
from .torque_loop import TorqueLoop


@dataclass(frozen=True, eq=False)
class Results:
    """Results of all steps.

    Parameters
    ----------
    actuator, model
        As declared, and flattened.
    design
        Cam, pretension and rubber for the torque curve of 2014.
    figures
        Model against the figures of the paper.
    chart
        Observability and stability over the cam angle.
    observers
        Minimal and published form on the bench.
    loop
        Generated code and the closed torque loop.
    verdict
        Of the diagnosis of the bench records.
    """

    actuator: nls.Assembly
    model: nls.FlatModel
    design: CamDesign
    figures: FigureComparison
    chart: Chart
    observers: ObserverComparison
    loop: TorqueLoop
    verdict: Verdict

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers, by name with unit."""
        figures, observers = self.figures, self.observers
        return {
            "design_torque_error_mNm_rms": 1e3 * self.design.rms,
            "fig8_rms_error_Nm": figures.agreement.rmse,
            "fig8_mean_relative_error_percent": figures.agreement.relative,
            "fig8_hooke_mean_relative_error_percent": figures.hooke_agreement.relative,
            "fig1_loop_area_model_over_paper": figures.loops["45°"].area_ratio,
            "observability_rank_at_zero": float(self.chart["observability.rank"][len(self.chart.at) // 2]),
            "cosimulation_difference_Nm": float(np.max(np.abs(self.loop.difference))),
            "verdict_held_out_error_over_noise": self.verdict.held_out_ratio,
            "observer_minimal_error_mNm_rms": 1e3 * observers.error(observers.minimal_estimate),
            "observer_published_error_mNm_rms": 1e3 * observers.error(observers.published_estimate),
        }
