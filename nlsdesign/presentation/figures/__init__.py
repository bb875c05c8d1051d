"""Figures: functions from results to matplotlib figures, and from figures to SVG in the page's colours."""

from matplotlib.figure import Figure

from .answer_histograms import MarkedQuantile, answer_histograms
from .answers_against import answers_against
from .before_after import (
    CandidateShare,
    HeldOut,
    RecordError,
    binned_errors,
    candidate_shares,
    gap_bars,
    held_out_series,
)
from .beside_points import PointPanel, curves_beside_points
from .cam_frames import CamPicture, cam_picture, torque_curve
from .cam_motion import CamMotion, cam_motion, cam_motion_of, cam_positions
from .curves import curves
from .design_figures import design_picture, limit_margins
from .design_pictures import DesignPictures, inspection_rows
from .loop_evaluation import (
    coupled_stability_map,
    impedance_over_frequency,
    margins_over_angle,
    torque_responses,
)
from .made_springs import tolerance_bars, torque_band
from .number_text import compact, significant
from .over_angle import observability_over_angle, observer_stability, stability_over_angle
from .over_time import ClosedLoopRun, closed_loop, closed_loop_of, observer_error, over_time
from .parallel_coordinates import parallel_coordinates
from .ranked import ranked_intervals
from .response_surfaces import SurfacePanel, response_surfaces
from .run_over_time import run_over_time
from .sensitivity_bars import VarianceShare, sensitivity_bars
from .spread_of_errors import errors_over_spread
from .style import alternative_text, described, styled
from .svg import inline_svg, svg_text, write_figures
from .sweep_points import PointKinds, ShownColumn
from .task_figures import curve_of_task, motor_over_task
from .torque import loop_area, metric_note, torque_against_measured, torque_against_target, torque_loops
from .trade_off import pareto_front
from .workshop_drawing import InspectionRow, TitleBlock, workshop_drawing

__all__ = [
    "CamMotion",
    "CamPicture",
    "CandidateShare",
    "ClosedLoopRun",
    "DesignPictures",
    "Figure",
    "HeldOut",
    "InspectionRow",
    "MarkedQuantile",
    "PointKinds",
    "PointPanel",
    "RecordError",
    "ShownColumn",
    "SurfacePanel",
    "TitleBlock",
    "VarianceShare",
    "alternative_text",
    "answer_histograms",
    "answers_against",
    "binned_errors",
    "cam_motion",
    "cam_motion_of",
    "cam_picture",
    "cam_positions",
    "candidate_shares",
    "closed_loop",
    "closed_loop_of",
    "compact",
    "coupled_stability_map",
    "curve_of_task",
    "curves",
    "curves_beside_points",
    "described",
    "design_picture",
    "errors_over_spread",
    "gap_bars",
    "held_out_series",
    "impedance_over_frequency",
    "inline_svg",
    "inspection_rows",
    "limit_margins",
    "loop_area",
    "margins_over_angle",
    "metric_note",
    "motor_over_task",
    "observability_over_angle",
    "observer_error",
    "observer_stability",
    "over_time",
    "parallel_coordinates",
    "pareto_front",
    "ranked_intervals",
    "response_surfaces",
    "run_over_time",
    "sensitivity_bars",
    "significant",
    "stability_over_angle",
    "styled",
    "svg_text",
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
