"""The picture of a model in a notebook: names stand beside the block, arrows point into and out of it."""

from __future__ import annotations

import re
from xml.etree import ElementTree

from nlsdesign.model.symbolic_view import block_svg

SVG = "{http://www.w3.org/2000/svg}"


def test_inputs_enter_on_the_left_and_outputs_leave_on_the_right() -> None:
    inputs = ["current [A]", "more [A]"]
    picture = ElementTree.fromstring(block_svg("motor", inputs, ["speed [rad/s]"], ["torque [N·m]"]))
    block = picture.find(f"{SVG}rect")
    left = float(block.get("x"))
    right = left + float(block.get("width"))
    place = {text.text: (float(text.get("x")), float(text.get("y"))) for text in picture.iter(f"{SVG}text")}
    anchor = {text.text: text.get("text-anchor") for text in picture.iter(f"{SVG}text")}
    assert place["current [A]"][0] < left < place["speed [rad/s]"][0] < right < place["torque [N·m]"][0]
    assert (anchor["current [A]"], anchor["torque [N·m]"]) == ("end", "start")
    arrows = [
        [float(number) for number in re.findall(r"-?\d+", path.get("d"))]
        for path in picture.iter(f"{SVG}path")
    ]
    assert len(arrows) == 3
    for (x, line, end, head_x, head_y, *steps), name in zip(
        arrows, ("current [A]", "more [A]", "torque [N·m]"), strict=True
    ):
        # From the name to the block or away from it; the tip of the head lies on the line.
        assert {x, end} & {left, right}
        assert place[name][0] < min(x, end) or place[name][0] > max(x, end)
        assert abs(line - place[name][1]) < 9.0
        assert head_y + steps[1] == line
        assert min(x, end) < head_x + steps[0] <= max(x, end)
        assert head_x < head_x + steps[0], "both point to the right"
