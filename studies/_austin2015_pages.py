"""The report of the study of the published actuator."""

from __future__ import annotations

from typing import Any

import nlsdesign as nls

from ._austin2015_against import figure_pages
from ._austin2015_numbers import key_numbers, numbers
from ._austin2015_watching import file_pages, loop_pages, observer_pages

ABSTRACT = (
    "Declared once, flattened once: the cam-rubber actuator of Austin, Schepelmann and Geyer (IROS 2015), "
    "its design, analysis, observer, generated code, co-simulation, and what bench records say is missing."
)


RECORDS = (
    "There are no public bench records of this actuator. These come from a rig simulation that shares no "
    "model code with the package (`tests/rig`): servoed motor, encoder, ammeter and load cell with noise, "
    "dry friction as declared, numbers within their declared spread, and a second, slower relaxation of the "
    "rubber that the deck does not declare."
)


def write_pages(done: dict[str, Any]) -> dict[str, float]:
    """Write the report and return the numbers of the study.

    Parameters
    ----------
    done
        What the stations have given, by name.
    """
    results = numbers(done)
    sections = [
        nls.report.NumbersSection("Key numbers", key_numbers(done, results)),
        *actuator_pages(done),
        *design_pages(done),
        *figure_pages(done),
        *observer_pages(done, results),
        *loop_pages(done, results),
        *nls.report.verdict_sections(done["verdict"]),
        nls.report.TextSection("Where the records come from", RECORDS),
        *file_pages(done),
    ]
    title = "A cam-rubber actuator, from deck to report"
    nls.write_report(done["out"] / "report.html", *sections, title=title, abstract=ABSTRACT)
    return results


def actuator_pages(done: dict[str, Any]) -> list[Any]:
    """Show what was declared."""
    actuator, model = done["actuator"], done["model"]
    return [
        nls.report.Chapter(
            "The actuator", "Every number has a unit, a source and a spread; what is assumed says so."
        ),
        nls.report.TextSection(
            "Parts", "The declaration, as `print(actuator)` draws it.", drawing=str(actuator)
        ),
        nls.report.numbers_table("Numbers of the deck", actuator.quantities(), folded=True),
        nls.report.EquationsSection(
            "Equations", nls.equations(model), "The flat model; `f(…)` stands for a long law."
        ),
    ]


def design_pages(done: dict[str, Any]) -> list[Any]:
    """Show the designed cam."""
    design = done["design"]
    designed = nls.flatten(design.actuator, outputs=["spring.torque"])
    motion = nls.figures.cam_motion_of(designed, design.contour)
    check = design.check
    figure = nls.figures.torque_against_target(
        design.target, {"designed actuator": (check.angles, check.torques)}
    )
    return [
        nls.report.Chapter("Design", "Contour, pretension and rubber designed together for 5 N·m at 53°."),
        nls.report.CamSection(
            "Cam, cable and rubber",
            motion,
            caption="Move the slider to turn the cam.",
            means="The contact point wanders outwards, so the lever arm grows and the spring stiffens.",
            assumed="Rubber at rest; the anchor of the cable is not dimensioned in the paper.",
        ),
        nls.report.FigureSection(
            "Torque against the target",
            figure,
            caption="Torque of the flattened, changed assembly.",
            means=f"Worst case over the moduli's spread: {design.sensitivity}.",
        ),
        nls.report.TableSection("What was found", ("what", "value"), tuple(design.rows())),
        nls.report.TableSection("Limits", ("limit",), tuple((str(state),) for state in design.limits)),
    ]
