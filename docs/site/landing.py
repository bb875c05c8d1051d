"""The picture of the first page: the reference actuator, drawn from its deck."""

from __future__ import annotations

import numpy as np

import nlsdesign as nls
from nlsdesign.design import contour_of_cam
from nlsdesign.presentation.figures import cam_motion_of, cam_positions
from nlsdesign.presentation.figures.svg import inline_svg

from . import markup

DECK = "austin2015_figure_consistent"


def picture() -> str:
    """Return the cam of the reference actuator at two angles, as SVG in a figure."""
    actuator = nls.declare(nls.load_deck(DECK))
    model = nls.flatten(actuator)
    motion = cam_motion_of(model, contour_of_cam(actuator.element("spring").cam), count=61)
    svg = inline_svg(cam_positions(motion, angles=[np.radians(20.0), np.radians(45.0)]), "reference")
    return markup.plot(svg, f"The cam of <code>{DECK}</code>, turned by 20° and by 45°")
