"""Figures: functions from results to matplotlib figures, and from figures to SVG in the page's colours."""

from matplotlib.figure import Figure

from .before_after import RecordError, gap_bars
from .beside_points import PointPanel, curves_beside_points
from .cam_frames import torque_curve
from .cam_motion import CamMotion, cam_motion_of, cam_positions
from .curves import curves
from .design_figures import design_picture, limit_margins
from .loop_evaluation import (
    coupled_stability_map,
    impedance_over_frequency,
    margins_over_angle,
    torque_responses,
)
from .made_springs import tolerance_bars, torque_band
from .number_text import compact
from .over_angle import observability_over_angle, stability_over_angle
from .over_time import ClosedLoopRun, closed_loop, closed_loop_of, observer_error, over_time
from .ranked import ranked_intervals
from .run_over_time import run_over_time
from .spread_of_errors import errors_over_spread
from .svg import inline_svg, write_figures
from .task_figures import curve_of_task, motor_over_task
from .torque import loop_area, metric_note, torque_against_measured, torque_against_target, torque_loops
from .trade_off import pareto_front
from .workshop_drawing import InspectionRow, TitleBlock, workshop_drawing

__all__ = [
    "CamMotion",
    "ClosedLoopRun",
    "Figure",
    "InspectionRow",
    "PointPanel",
    "RecordError",
    "TitleBlock",
    "cam_motion_of",
    "cam_positions",
    "closed_loop",
    "closed_loop_of",
    "compact",
    "coupled_stability_map",
    "curve_of_task",
    "curves",
    "curves_beside_points",
    "design_picture",
    "errors_over_spread",
    "gap_bars",
    "impedance_over_frequency",
    "inline_svg",
    "limit_margins",
    "loop_area",
    "margins_over_angle",
    "metric_note",
    "motor_over_task",
    "observability_over_angle",
    "observer_error",
    "over_time",
    "pareto_front",
    "ranked_intervals",
    "run_over_time",
    "stability_over_angle",
    "tolerance_bars",
    "torque_against_measured",
    "torque_against_target",
    "torque_band",
    "torque_curve",
    "torque_loops",
    "torque_responses",
    "workshop_drawing",
    "write_figures",
]
