"""The picture of the first page: the reference actuator, drawn from its deck."""

from __future__ import annotations

import re

import numpy as np

import nlsdesign as nls
from nlsdesign.design import contour_of_cam
from nlsdesign.figures import cam_motion_of, cam_positions
from nlsdesign.figures.svg import inline_svg

DECK = "austin2015_figure_consistent"


def picture() -> str:
    """Return the cam of the reference actuator at rest and turned, as SVG in a figure."""
    actuator = nls.declare(nls.load_deck(DECK))
    model = nls.flatten(actuator)
    motion = cam_motion_of(model, contour_of_cam(actuator.element("spring").cam), count=61)
    svg = inline_svg(cam_positions(motion, angles=[0.0, float(np.max(motion.angles))]), "reference")
    svg = re.sub(r"\n\s*\n", "\n", svg)
    return f'<figure class="plot">{svg}<figcaption>The cam of <code>{DECK}</code>, at rest and at the end of its range</figcaption></figure>'
