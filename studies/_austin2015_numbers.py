"""The numbers that the study of the published actuator claims."""

from __future__ import annotations

from typing import Any

import numpy as np

import nlsdesign as nls


def numbers(done: dict[str, Any]) -> dict[str, float]:
    """Return the claimed numbers, by name with unit."""
    figures, chart = done["figures"], done["chart"]
    run, whole = done["run"].trace, done["whole"]
    together = run["plant.spring.torque"] - np.interp(run.time, whole.time, whole["plant.spring.torque"])
    settled = done["bench"].time > 1.0
    found = {
        "design_torque_error_mNm_rms": 1e3 * done["design"].rms,
        "fig8_rms_error_Nm": figures.agreement.rmse,
        "fig8_mean_relative_error_percent": figures.agreement.relative,
        "fig8_hooke_mean_relative_error_percent": figures.hooke_agreement.relative,
        "fig1_loop_area_model_over_paper": loop_ratio(figures.loops["45°"]),
        "observability_rank_at_zero": float(chart["observability.rank"][len(chart.at) // 2]),
        "cosimulation_difference_Nm": float(np.max(np.abs(together))),
        "verdict_held_out_error_over_noise": done["verdict"].held_out_ratio,
    }
    for name, seen in done["watched"].items():
        error = (seen["spring.torque"] - done["bench"]["spring.torque"])[settled]
        found[f"observer_{name.split()[0]}_error_mNm_rms"] = 1e3 * float(np.sqrt(np.mean(error**2)))
    return found


def key_numbers(done: dict[str, Any], found: dict[str, float]) -> tuple[Any, ...]:
    """Return what stands at the top of the page."""
    assumed = nls.sources(done["actuator"].quantities())["assumed"]
    return (
        nls.report.KeyNumber(
            "torque of the model", f"{found['fig8_rms_error_Nm']:.3f} N·m rms", "against Fig. 8; paper: 0.10"
        ),
        nls.report.KeyNumber(
            "designed torque", f"{found['design_torque_error_mNm_rms']:.2g} mN·m rms", "5 N·m at 53°"
        ),
        nls.report.KeyNumber(
            "torque observer",
            f"{found['observer_minimal_error_mNm_rms']:.2g} mN·m rms",
            "through the encoder",
        ),
        nls.report.KeyNumber(
            "FMUs against one piece", f"{found['cosimulation_difference_Nm']:.1e} N·m", "closed loop"
        ),
        nls.report.KeyNumber(
            "held-out error", f"{found['verdict_held_out_error_over_noise']:.2f} × noise", "after diagnosis"
        ),
        nls.report.KeyNumber("numbers only assumed", f"{100 * assumed:.0f} %", "of the deck"),
    )


def loop_ratio(loop: Any) -> float:
    """Return the area of the simulated loop over that of the drawn one."""
    measured, simulated = loop
    return float(abs(nls.figures.loop_area(*simulated) / nls.figures.loop_area(*measured)))
