"""Figures: functions from results to matplotlib figures, and from figures to SVG in the page's colours."""

from matplotlib.figure import Figure

from .before_after import RecordError, gap_bars
from .cam_motion import cam_motion_of, cam_positions, torque_curve
from .curves import (
    PointPanel,
    curves,
    curves_beside_points,
    loop_area,
    metric_note,
    torque_against_measured,
    torque_against_target,
    torque_loops,
)
from .design_figures import (
    curve_of_task,
    motor_over_task,
    pareto_front,
    springs_for_task,
    tolerance_bars,
    torque_band,
)
from .design_pictures import DesignPictures
from .loop_evaluation import (
    impedance_over_frequency,
    margins_over_angle,
    torque_responses,
)
from .loop_evaluation import passivity_words as passivity_words
from .loop_evaluation import (
    write_loop_figures as write_loop_figures,
)
from .over_angle import errors_over_spread, observability_over_angle, ranked_intervals, stability_over_angle
from .over_time import closed_loop, closed_loop_of, observer_error, over_time
from .style import compact
from .svg import inline_svg, write_figures
from .workshop_drawing import InspectionRow, TitleBlock, workshop_drawing

__all__ = [
    "DesignPictures",
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
    "curve_of_task",
    "curves",
    "curves_beside_points",
    "errors_over_spread",
    "gap_bars",
    "impedance_over_frequency",
    "inline_svg",
    "loop_area",
    "margins_over_angle",
    "metric_note",
    "motor_over_task",
    "observability_over_angle",
    "observer_error",
    "over_time",
    "pareto_front",
    "ranked_intervals",
    "springs_for_task",
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
