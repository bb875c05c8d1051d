"""``nlsdesign design``: a cam, and rubber with it, for a target torque curve or a task."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import NlsError, ValueRangeError
from .design_kinds import KINDS, show_kinds
from .named_paths import NamedPath
from .output import DECK_HELP, examples, json_option, show_json, show_table, spring_option
from .overwriting import out_option
from .range_remarks import range_remarks, warn
from .units import parse_number
from .workers import workers_option

if TYPE_CHECKING:
    from ..components.assembly.named_parts import Assembly
    from ..design import CamDesign, DesignJob, Target

_LINE = "repeatable; a line as in a design file, for instance"
_ENTRY = re.compile(r"""\s*([\w.-]+|"[^"]*"|'[^']*')\s*=""")
_FORMS = {
    "target": 'ExponentialTorque = {maximum = "0.3 N*m", angle = "60 deg", shape = 1.0}',
    "limit": 'MaximumCamRadius = {radius = "20 mm"}',
    "goal": "TorqueError = {}",
    "stock": '"spring.cam.elements" = [1, 2, 4]',
}
"""How an entry of each option is written."""
_FILES = (
    "report.html",
    *("model.toml", "design.json", "picture.svg", "torque.svg", "margins.svg", "tolerance.svg"),
    *("cam.csv", "cam_centre_line.csv", "cam.svg", "cam.dxf", "drawing.svg", "drawing.pdf"),
)
_TASK_FILES = ("task_curve.svg", "task_motor.svg")


def _writes(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files of the design that is asked for, and of what an earlier one has left."""
    if given["deck_name"] is None:
        raise click.MissingParameter(param_type="option", param_hint="'--deck'")
    from ..design import Target

    job = _job(**given)
    never = set() if job.settings.draws else {"tolerance.svg"}
    names = [name for name in _FILES if name not in never or (given["out"] / name).exists()]
    return names if isinstance(job.target, Target) else [*names, *_TASK_FILES]


@click.command(
    epilog=examples(
        "nlsdesign design --deck austin2015_figure_consistent --maximum '5 N*m' --angle '53 deg' "
        "--shape 1 --free spring.cam.contour --free spring.pretension --free spring.rubber.area "
        "--free spring.rubber.rest_length --limit 'MaximumCamRadius = {radius = \"20 mm\"}'",
        "nlsdesign design --list limits",
        "nlsdesign design --deck my.toml --task job.toml --out out/my_cam",
        "nlsdesign design --deck my.toml --target-file curve.csv --goal 'TorqueError = {}' --dry-run",
    )
)
@click.option("--deck", "deck_name", metavar="DECK", help=DECK_HELP + "  [required]")
@click.option("--list", "listed", type=click.Choice(KINDS), default=None,
              help="Only list what a design can be asked for: names, fields, units, defaults.")  # fmt: skip
@click.option(
    "--task", "task_file", type=NamedPath(dir_okay=False), default=None,
    help="Design file (TOML) with target, free names, limits, goals, stock.",
)  # fmt: skip
@click.option("--target", default=None, help="Target curve: 'PowerTorque = {coefficient = 4.35, ...}'.")
@click.option(
    "--target-file", type=NamedPath(dir_okay=False), default=None,
    help="Target curve as CSV with units in its heads.",
)  # fmt: skip
@click.option("--maximum", default=None, help='Exponential target: torque at the end, e.g. "5 N·m".')
@click.option("--angle", default=None, help='Exponential target: angle at the end, e.g. "53 deg".')
@click.option("--shape", type=float, default=1.0, show_default=True,
              help="Exponential target: exponent c in 1/rad.")  # fmt: skip
@click.option(
    "--free", multiple=True, help="Quantity that may change, e.g. spring.cam.contour, which is the default."
)
@click.option("--limit", multiple=True, help=f"Limit; {_LINE} 'MaximumCamRadius = {{radius = \"20 mm\"}}'.")
@click.option("--goal", multiple=True, help=f"Goal; {_LINE} 'TorqueError = {{}}'.")
@click.option("--stock", multiple=True, help=f"Stock; {_LINE} '\"spring.cam.elements\" = [1, 2, 4]'.")
@click.option("--starts", type=int, default=None, help="Number of starting points.")
@click.option("--seed", type=int, default=None, help="Seed of the starts after the fourth, and of the draws.")
@click.option("--largest-error", default=None, help='Rms error that is no miss, e.g. "1 %" of the torque.')
@click.option("--draws", type=int, default=None, help="Draws of the tolerance, else 1000; 0: none.")
@spring_option
@workers_option
@out_option("out/design", writes=_writes)
@json_option
@click.pass_context
def design(context: click.Context, /, deck_name: str, out: Path, as_json: bool, **given: Any) -> None:
    """Design cam and rubber for a torque curve; exit status 1 if the design misses its target.

    Limits of the declared cable and rubber hold unless one of the same kind is given.
    """
    if given.pop("listed") is not None:
        show_kinds(context.params["listed"], as_json)
        return
    from ..components.assembly.deck_writer import declare
    from ..design import design_cam
    from ..foundation.deck import load_deck
    from ..foundation.progress import Steps
    from ..presentation.report import write_design_report

    actuator, job = declare(load_deck(deck_name)), _job(**given)
    steps = Steps()
    target = _target_of(job, actuator, out, steps)
    with steps.step("design"):
        designed = design_cam(
            actuator,
            target=target,
            free=job.free,
            spring=given["spring"] or job.spring,
            keep=job.keep,
            goals=job.goals,
            settings=_with_progress(job, steps.note),
        )
    files = _written(designed, out)
    remarks = _trim_remarks(designed)
    if designed.met:
        with steps.step("drawings"):
            files += _drawn(designed, job, deck_name, out, remarks)
    # The deck that is written, over the angles that were asked for.
    ranges = range_remarks(designed.actuator, first=0.0, last=designed.target.last_angle)
    warn(ranges)
    files.append(
        write_design_report(out / "report.html", designed, deck=deck_name, remarks=remarks, files=files)
    )
    if as_json:
        show_json({**_numbers(designed), "remarks": remarks, "warnings": ranges, "files": files})
    else:
        _show(designed, files)
        for remark in remarks:
            click.echo(remark)
    sys.exit(0 if designed.met else 1)


def _job(**given: Any) -> DesignJob:
    """Return what is asked for, from a design file or from the options."""
    from ..design import job_of, read_job

    options = ("target", "target_file", "maximum", "angle", "free", "limit", "goal", "stock")
    if given["task_file"] is not None:
        doubled = [f"--{name.replace('_', '-')}" for name in options if given[name]]
        if doubled:
            raise ValueRangeError(
                ", ".join(doubled), "stand beside --task, which says all that",
                next_step="write them into the design file, or leave --task out",
            )  # fmt: skip
        return _searched(read_job(given["task_file"]), given)
    return _searched(job_of(_as_text(given), Path("command line")), given)


def _as_text(given: dict[str, Any]) -> str:
    """Return the options as the text of a design file."""
    for option, form in _FORMS.items():
        for text in [given[option]] if isinstance(given[option], str) else given[option] or ():
            if not _ENTRY.match(text):
                raise ValueRangeError(
                    f"--{option} '{text}'", "is not NAME = {...}", next_step=f"write {form}"
                )
    quoted = ", ".join(map(_quoted, given["free"]))
    lines = [f"free = [{quoted}]"] if quoted else []
    targets = []
    if given["target"]:
        targets.append(str(given["target"]))
    if given["target_file"]:
        targets.append(f"file = {_quoted(str(given['target_file'].absolute()))}")
    if given["maximum"] or given["angle"]:
        if not (given["maximum"] and given["angle"]):
            raise ValueRangeError(
                "--maximum and --angle",
                "belong together",
                next_step='give --maximum "5 N·m" --angle "53 deg"',
            )
        for name, unit in (("maximum", "N*m"), ("angle", "deg")):
            try:
                parse_number(given[name], unit)
            except NlsError as error:
                raise error.at(f"--{name}") from None
        targets.append(
            f'ExponentialTorque = {{maximum = "{given["maximum"]}", angle = "{given["angle"]}", '
            f"shape = {given['shape']}}}"
        )
    if not targets:
        raise ValueRangeError(
            "no target", "is given",
            next_step='write --maximum "5 N·m" --angle "53 deg", or --target, --target-file or --task',
        )  # fmt: skip
    for head, rows in (("target", targets), *((f"{k}s", given[k]) for k in ("limit", "goal"))):
        lines += [f"[{head}]", *rows]
    return "\n".join([*lines, "[stock]", *given["stock"]]) + "\n"


def _quoted(text: str) -> str:
    """Return a text as TOML, whatever quotes and backslashes are in it."""
    import json

    return json.dumps(text, ensure_ascii=False)


def _searched(job: DesignJob, given: dict[str, Any]) -> DesignJob:
    from dataclasses import replace

    names = ("starts", "seed", "draws")
    changes: dict[str, Any] = {name: given[name] for name in names if given[name] is not None}
    if given["largest_error"] is not None:
        changes["largest_error"] = parse_number(given["largest_error"], "1").number
    return replace(job, settings=replace(job.settings, **changes))


def _with_progress(job: DesignJob, note: Callable[[str], None]) -> Any:
    from dataclasses import replace

    done = [0]

    def progress() -> None:
        done[0] += 1
        note(f"{done[0]} done")

    return replace(job.settings, progress=progress)


def _target_of(job: DesignJob, actuator: Assembly, out: Path, steps: Any) -> Target:
    """Return the target; one that follows from a task is worked out, shown and drawn first."""
    from ..design import Target, TaskTarget
    from ..foundation.text_files import make_folder
    from ..model import flatten
    from ..presentation.figures import curve_of_task, motor_over_task, write_figures

    if isinstance(job.target, Target):
        return job.target
    assert isinstance(job.target, TaskTarget)
    with steps.step("curve for the task"):
        curve = job.target.curve(flatten(actuator), job.path.parent)
    make_folder(out)
    write_figures(out, {"task_curve": curve_of_task(curve), "task_motor": motor_over_task(curve)})
    click.echo(str(curve))
    return curve.target


def _written(designed: CamDesign, out: Path) -> list[Path]:
    """Write deck, result and pictures; drawings for the workshop only of a design that meets its target."""
    import json

    from ..components.assembly.deck_writer import write_deck
    from ..foundation.text_files import discard, make_folder, write_text
    from ..presentation.figures import (
        design_picture,
        limit_margins,
        tolerance_bars,
        torque_against_target,
        write_figures,
    )

    make_folder(out)
    for name in _FILES:
        # What an earlier run has left here belongs to another design.
        discard(out / name)
    model, numbers = out / "model.toml", out / "design.json"
    write_deck(designed.actuator, model)
    # How many iterations it took depends on the processor, the design does not.
    rows = [row for row in designed.rows() if row[0] not in ("solver", "starts")]
    content = {**_numbers(designed), "rows": rows}
    write_text(numbers, json.dumps(content, indent=2, ensure_ascii=False, default=str) + "\n")
    curve = {"design": (designed.check.angles, designed.check.torques)}
    pictures: dict[str, Any] = {
        "picture": design_picture(designed),
        "torque": torque_against_target(designed.target, curve),
    }
    if designed.limits:
        pictures["margins"] = limit_margins(designed)
    if designed.tolerance is not None and designed.tolerance.causes:
        pictures["tolerance"] = tolerance_bars(designed.tolerance)
    return [model, numbers, *write_figures(out, pictures)]


def _trim_remarks(designed: CamDesign) -> list[str]:
    """Return where made springs have to be set beyond a limit that holds for the nominal one."""
    from ..foundation.quantity import parse_unit, with_unit

    remarks = []
    for trim in designed.tolerance.trims[:1] if designed.tolerance is not None else ():
        low, high = trim.needed
        for state in designed.limits:
            if state.of == trim.name and (high > state.bound if state.upper else low < state.bound):
                factor = parse_unit(state.unit).factor
                needed = with_unit(f"{low / factor:.4g} to {high / factor:.4g}", state.unit)
                bound = with_unit(f"{state.bound / factor:.4g}", state.unit)
                remarks.append(
                    f"{state.limit} holds for the nominal spring: to trim 95 % of the made ones, {trim.name} "
                    f"is set from {needed}, beyond {bound} -> leave it that travel, or narrow the spreads"
                )
    return remarks


def _drawn(designed: CamDesign, job: DesignJob, deck_name: str, out: Path, remarks: list[str]) -> list[Path]:
    """Write the drawings of the machined part, or of the contour alone where no part can be made of it."""
    import numpy as np

    from ..design import machined_cam, write_drawings
    from ..presentation.figures import InspectionRow, TitleBlock, workshop_drawing, write_figures

    note = f"design {designed.fingerprint}"
    try:
        machined = machined_cam(designed, job)
        part = machined.part(designed.contour)
    except NlsError as error:
        # The contour is worth having even where hub, channel and cable do not fit it yet.
        remarks.append(f"no machined part, only the line of the cable's centre: {error}")
        return write_drawings(out, designed.contour, note=note)
    reach = max(float(np.hypot(*outline.polygon().T).max()) for outline in part.outlines)
    remarks.append(
        f"the made part reaches {1e3 * reach:.4g} mm from its axis, the contour "
        f"{1e3 * float(designed.contour.radii.max()):.4g} mm: run-out and corners come on top"
    )
    if machined.hub_bore is None and machined.bolts is None:
        remarks.append("nothing holds the part yet: name hub_bore, bolts or cable_end under [drawing]")
    check, curves = designed.check, designed.curves
    angles = np.linspace(0.0, designed.target.last_angle, 11)
    rows = [
        InspectionRow(
            float(angle),
            float(np.interp(angle, check.angles, check.torques)),
            float(np.interp(angle, curves.angles, curves.lever_arms)),
            float(np.interp(angle, curves.angles, curves.forces)),
        )
        for angle in angles
    ]
    title = TitleBlock(title="cam", deck=deck_name, fingerprint=designed.fingerprint)
    page = workshop_drawing(part, title=title, rows=rows)
    files = write_drawings(out, designed.contour, machined=machined, note=note)
    return [
        *files,
        *write_figures(out, {"drawing": page}),
        *write_figures(out, {"drawing": page}, suffix=".pdf"),
    ]


def _numbers(designed: CamDesign) -> dict[str, Any]:
    spread = {}
    if designed.tolerance is not None:
        spread = {f"{100 * q.share:g} %": _rounded(q.value) for q in designed.tolerance.quantiles}
    return {
        "met": designed.met,
        "torque_error_rms": _rounded(designed.rms),
        "miss": None if designed.miss is None else str(designed.miss),
        "advice": [] if designed.miss is None else list(designed.miss.advice),
        "values": {name: quantity.value for name, quantity in designed.values.items()},
        "active_limits": list(designed.active_limits),
        "largest_cable_force": _rounded(float(designed.curves.forces.max())),
        "energy": _rounded(designed.curves.energy),
        "rms_error_over_spreads": spread,
    }


def _rounded(value: float) -> float:
    """Return what a result is good for: six digits, the same on every processor."""
    return float(f"{value:.6g}")


def _show(designed: CamDesign, files: Iterable[Path]) -> None:
    limits = (("limit", str(state)) for state in designed.limits)
    show_table("Design", ("what", "value"), [*designed.rows(), *limits])
    if designed.tolerance is not None:
        show_table("Tolerance", ("what", "value"), designed.tolerance.rows())
    click.echo("written: " + ", ".join(str(path) for path in files))
    if not designed.met:
        click.echo("no drawings are written of a design that misses its target")
