"""The figures of an evaluated torque loop as files."""

from __future__ import annotations

from pathlib import Path

from ...feedback.control import LoopEvaluation
from ...foundation.text_files import make_folder
from .loop_evaluation import (
    coupled_stability_map,
    impedance_over_frequency,
    margins_over_angle,
    torque_responses,
)
from .svg import write_figures


def write_loop_figures(result: LoopEvaluation, folder: Path) -> list[Path]:
    """Write what is drawn of an evaluated torque loop as SVG files.

    Parameters
    ----------
    result
        Of the evaluation.
    folder
        Is made where it does not exist.
    """
    make_folder(folder)
    drawn = {
        "responses": torque_responses(result.responses, result.line),
        "impedance": impedance_over_frequency(result.impedance),
        "margins": margins_over_angle(result.margins),
        "coupled_stability": coupled_stability_map(result.coupled),
    }
    return write_figures(folder, drawn)
