"""Figures: functions from results to matplotlib figures, and from figures to SVG in the page's colours."""

from matplotlib.figure import Figure

from .cam import CamMotion, cam_motion, cam_motion_of, cam_positions
from .cam_frames import CamPicture, cam_picture, torque_curve
from .curves import curves
from .gap import CandidateShare, HeldOut, RecordError, candidate_shares, gap_bars, held_out_series
from .numbers import compact, shown_unit, significant
from .over_angle import observability_over_angle, observer_stability, stability_over_angle
from .over_time import ClosedLoop, closed_loop, closed_loop_of, observer_error, over_time
from .style import alternative_text, described, styled
from .svg import inline_svg, svg_text, write_figures
from .torque import loop_area, metric_note, torque_against_measured, torque_against_target, torque_loops

__all__ = [
    "CamMotion",
    "CamPicture",
    "CandidateShare",
    "ClosedLoop",
    "Figure",
    "HeldOut",
    "RecordError",
    "alternative_text",
    "cam_motion",
    "cam_motion_of",
    "cam_picture",
    "cam_positions",
    "candidate_shares",
    "closed_loop",
    "closed_loop_of",
    "compact",
    "curves",
    "described",
    "gap_bars",
    "held_out_series",
    "inline_svg",
    "loop_area",
    "metric_note",
    "observability_over_angle",
    "observer_error",
    "observer_stability",
    "over_time",
    "shown_unit",
    "significant",
    "stability_over_angle",
    "styled",
    "svg_text",
    "torque_against_measured",
    "torque_against_target",
    "torque_curve",
    "torque_loops",
    "write_figures",
]
