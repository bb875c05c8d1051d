"""A cam that the reader turns with a slider."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar

from ..figures import CamMotion, inline_svg
from ..figures.cam_frames import MARKER, cam_picture
from .data_link import data_link
from .html import Html
from .sections import PagePosition, Section


@dataclass(frozen=True, eq=False)
class CamSection(Section):
    """Cam, cable, rubber and contact point over the angle, with a slider; a single frame without JavaScript.

    Parameters
    ----------
    motion
        Cam over its range.
    caption, means, assumed
        As for :class:`FigureSection`.
    start
        Angle in rad that is shown first; 60 % of the range by default.
    """

    motion: CamMotion
    _: KW_ONLY
    caption: str
    means: str = ""
    assumed: str = ""
    start: float | None = None
    template: ClassVar[str] = "cam.html"

    def content(self, place: PagePosition) -> Mapping[str, Any]:
        """Return picture, frames and texts."""
        picture = cam_picture(self.motion, start=self.start)
        return {
            "key": place.key,
            "picture": picture,
            "frame": picture.frames[picture.start],
            "frames": json.dumps(picture.frames, ensure_ascii=False, separators=(",", ":")),
            "marker": f"{place.key}-{MARKER}",
            "curve": Html(inline_svg(picture.curve, place.key)),
            "warning": self.motion.warning,
            "data": data_link(picture.curve, self.title),
            "caption": self.caption,
            "means": self.means,
            "assumed": self.assumed,
        }
