"""``nlsdesign design``: a cam, and rubber with it, for a target torque curve or a task."""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from ..foundation.errors import NlsError, ValueRangeError
from .options import DECK_HELP, json_option, machine_of, spring_option, workers_option
from .output import examples, show_json, show_table, warn
from .overwriting import out_option
from .typed_values import NamedPath, parse_number

if TYPE_CHECKING:
    from ..components import Assembly
    from ..design import DesignJob, Limit, Target, TaskTarget

KINDS = ("targets", "limits", "goals")
_FIELD = re.compile(r"^(?P<names>\w+(?:, \w+)*)\n(?P<text>(?:[ ]{4}.*\n?|\n(?=[ ]{4}))+)", re.MULTILINE)

_MARKED = re.compile(r":\w+:`~?([^`]+)`")

_LINE = "repeatable; a line as in a design file, for instance"
_ENTRY = re.compile(r"""\s*([\w.-]+|"[^"]*"|'[^']*')\s*=""")
_FORMS = {
    "target": 'ExponentialTorque = {maximum = "0.3 N*m", angle = "60 deg", shape = 1.0}',
    "back_target": 'PowerTorque = {coefficient = 1.0, exponent = 1.0, angle = "20 deg"}',
    "limit": 'MaximumCamRadius = {radius = "20 mm"}',
    "goal": "TorqueError = {}",
    "stock": '"spring.cam.elements" = [1, 2, 4]',
}
"""How an entry of each option is written."""
_SIDES = ("front.html", "back.html", "cam_back.csv")
_TASK_FILES = ("task_curve.svg", "task_motor.svg", "task_springs.svg")


def _writes(given: Mapping[str, Any]) -> list[str]:
    """Return the names of the files of the design that is asked for, and of what an earlier one has left."""
    if given["deck_name"] is None:
        raise click.MissingParameter(param_type="option", param_hint="'--deck'")
    from ..design import DESIGN_FILES, Target

    job = _job(**given)
    never = set() if job.settings.draws else {"tolerance.svg"}
    if job.back is not None:
        return [*_SIDES, *(name for name in DESIGN_FILES if name.startswith(("model", "cam")))]
    names = [
        name for name in ("report.html", *DESIGN_FILES) if name not in never or (given["out"] / name).exists()
    ]
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
    "--back-target", default=None,
    help="Curve for negative angles of a LopsidedCam, both signs turned: 'PowerTorque = {...}'.",
)  # fmt: skip
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
@click.option("--starts", type=int, default=None, help="Most starting points of the search.")
@click.option("--seed", type=int, default=None, help="Seed of the starts after the fourth, and of the draws.")
@click.option(
    "--largest-error",
    default=None,
    help='Largest rms error that still meets the target, e.g. "1 %" of the torque.',
)
@click.option("--draws", type=int, default=None, help="Draws of the tolerance, else 1000; 0: none.")
@spring_option
@workers_option
@out_option("out/design", writes=_writes)
@json_option
@click.pass_context
def design(context: click.Context, /, deck_name: str, out: Path, as_json: bool, **given: Any) -> None:
    """Design cam and rubber for a torque curve. Exit status 1 if the design misses its target.

    Limits of the declared cable and rubber hold unless one of the same kind is given.
    """
    if given.pop("listed") is not None:
        show_kinds(context.params["listed"], as_json)
        return
    from ..design import design_cam, design_summary, write_design
    from ..foundation.progress import Steps
    from ..presentation.figures import DesignPictures
    from ..presentation.report import write_design_report
    from ..regeneration import range_remarks

    actuator, job = machine_of(deck_name), _job(**given)
    job = dataclasses.replace(job, spring=given["spring"] or job.spring)
    steps = Steps()
    target = _target_of(job, actuator, out, steps)
    if job.back is not None:
        _both_sides(actuator, deck_name, (target, job.back), job=job, out=out, as_json=as_json)
    with steps.step("design"):
        designed = design_cam(
            actuator,
            target=target,
            free=job.free,
            spring=job.spring,
            keep=job.keep,
            goals=job.goals,
            settings=_with_progress(job, steps.note),
        )
    with steps.step("drawings") if designed.met else nullcontext():
        written = write_design(designed, out, job=job, pictures=DesignPictures(deck=deck_name))
    remarks = list(written.remarks)
    # The deck that is written, over the angles that were asked for.
    ranges = range_remarks(designed.actuator, first=0.0, last=designed.target.last_angle)
    warn(ranges)
    report = write_design_report(
        out / "report.html", designed, deck=deck_name, remarks=remarks, files=written.files
    )
    files = [*written.files, report]
    if as_json:
        show_json({**design_summary(designed), "remarks": remarks, "warnings": ranges, "files": files})
    else:
        limits = (("limit", str(state)) for state in designed.limits)
        show_table("Design", ("what", "value"), [*designed.rows(), *limits])
        if designed.tolerance is not None:
            show_table("Tolerance", ("what", "value"), designed.tolerance.rows())
        click.echo("written: " + ", ".join(str(path) for path in files))
        if not designed.met:
            click.echo("no drawings are written of a design that misses its target")
        for remark in remarks:
            click.echo(remark)
    sys.exit(0 if designed.met else 1)


def _both_sides(
    actuator: Assembly, deck: str, targets: tuple[Target, Target], *, job: DesignJob, out: Path, as_json: bool
) -> NoReturn:
    """Design both contours of a cam whose sides differ; write deck, drawings and a report of each side."""
    from ..design import design_sides, design_summary, machined_cam, write_sides
    from ..presentation.report import write_design_report

    both = design_sides(
        actuator, targets=targets, free=job.free, keep=job.keep, spring=job.spring, goals=job.goals,
        settings=job.settings,
    )  # fmt: skip
    files = [*write_sides(both, out, machined=machined_cam(both.front, job) if both.met else None)]
    sides = {"front": both.front, "back": both.back}
    chosen = f"what both sides share was chosen by the {both.chosen_by}"
    for name, side in sides.items():
        remarks = [f"the {name} of the cam: {chosen}"]
        files.append(write_design_report(out / f"{name}.html", side, deck=deck, remarks=remarks))
    if as_json:
        numbers = {name: design_summary(side) for name, side in sides.items()}
        show_json({**numbers, "chosen_by": both.chosen_by, "files": files})
    else:
        for name, side in sides.items():
            show_table(f"Design, {name}", ("what", "value"), side.rows())
        click.echo(chosen)
        click.echo("written: " + ", ".join(str(path) for path in files))
    sys.exit(0 if both.met else 1)


def _job(**given: Any) -> DesignJob:
    """Return what is asked for, from a design file or from the options."""
    from ..design import (
        DRAWS,
        GOALS,
        DesignJob,
        DesignSettings,
        Goal,
        Limit,
        back_of,
        read_entries,
        read_job,
        read_stock,
        read_target_entry,
    )

    options = ("target", "back_target", "target_file", "maximum", "angle", "free", "limit", "goal", "stock")
    if given["task_file"] is not None:
        doubled = [f"--{name.replace('_', '-')}" for name in options if given[name]]
        if doubled:
            raise ValueRangeError(
                ", ".join(doubled), "stand beside --task, which says all that",
                next_step="write them into the design file, or leave --task out",
            )  # fmt: skip
        return _searched(read_job(given["task_file"]), given)
    for option in _FORMS:
        for text in filter(None, [given[option]] if option.endswith("target") else given[option]):
            if not _ENTRY.match(text):
                raise ValueRangeError(
                    f"--{option} '{text}'", "is not NAME = {...}", next_step=f"write {_FORMS[option]}"
                )
    target, band = _target(given)
    limits = [limit for text in given["limit"] for limit in read_entries(text, Limit, "--limit")]  # type: ignore[type-abstract]
    goals = [goal for text in given["goal"] for goal in read_entries(text, Goal, "--goal")]  # type: ignore[type-abstract]
    stock = [choice for text in given["stock"] for choice in read_stock(text, "--stock")]
    job = DesignJob(
        path=Path("command line"),
        target=target,
        free=(*given["free"], *stock) or None,
        keep=(*limits, *band),
        goals=tuple(goals) or GOALS,
        spring=None,
        settings=DesignSettings(draws=DRAWS),
        back=back_of(read_target_entry(given["back_target"], "--back-target")[0])
        if given["back_target"]
        else None,
    )
    return _searched(job, given)


def _target(given: dict[str, Any]) -> tuple[Target | TaskTarget, tuple[Limit, ...]]:
    """Return the target that the options name, and the band that stands beside it in a file."""
    from ..design import ExponentialTorque, read_target_entry, target_of_file

    if bool(given["maximum"]) != bool(given["angle"]):
        raise ValueRangeError(
            "--maximum and --angle", "belong together", next_step='give --maximum "5 N·m" --angle "53 deg"'
        )
    named = [name for name in ("target", "target_file", "maximum") if given[name]]
    if len(named) > 1:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in named)
        raise ValueRangeError(options, "name more than one target", next_step="keep one of them")
    if given["target"]:
        return read_target_entry(given["target"], "--target")
    if given["target_file"]:
        return target_of_file(given["target_file"])
    if not named:
        raise ValueRangeError(
            "no target", "is given",
            next_step='write --maximum "5 N·m" --angle "53 deg", or --target, --target-file or --task',
        )  # fmt: skip
    numbers = {}
    for name, unit in (("maximum", "N*m"), ("angle", "deg")):
        try:
            numbers[name] = parse_number(given[name], unit)
        except NlsError as error:
            raise error.at(f"--{name}") from None
    return ExponentialTorque(**numbers, shape=given["shape"]), ()


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
    from ..presentation.figures import curve_of_task, motor_over_task, springs_for_task, write_figures

    if isinstance(job.target, Target):
        return job.target
    assert isinstance(job.target, TaskTarget)
    with steps.step("curve for the task"):
        choice = job.target.choice(flatten(actuator), job.path.parent)
    make_folder(out)
    pictures = {"task_springs": springs_for_task(choice)}
    if choice.series:
        pictures |= {"task_curve": curve_of_task(choice.series), "task_motor": motor_over_task(choice.series)}
        click.echo(str(choice.series))
    write_figures(out, pictures)
    click.echo(str(choice))
    return job.target.target(choice)


def show_kinds(what: str, as_json: bool) -> None:
    """Print the targets, limits or goals that a design file can name."""
    known = design_kinds(what)
    if as_json:
        show_json(known)
        return
    rows = []
    for name, content in known.items():
        rows.append((name, "", "", content["meaning"]))
        for field, about in content["fields"].items():
            rows.append(("", field, str(about["default"]) if about["optional"] else "", about["meaning"]))
    show_table(f"{what.capitalize()} of a design", ("name", "field", "default", "meaning"), rows)
    option = {"targets": "--target", "limits": "--limit", "goals": "--goal"}[what]
    table = "target" if what == "targets" else what
    click.echo(
        f"on the command line: {option} 'NAME = {{field = \"number unit\", ...}}'; in a design file the same "
        f"line stands below [{table}]"
    )


def design_kinds(what: str) -> dict[str, dict[str, Any]]:
    """Return meaning and fields of what a design file can name, by name."""
    from ..design import Goal, Limit, Target, TaskTarget, kinds

    base: type = {"targets": Target, "limits": Limit, "goals": Goal}[what]
    known = kinds(base) | ({"TaskTarget": TaskTarget} if what == "targets" else {})
    return {
        name: {"meaning": _plain((inspect.getdoc(kind) or "").split("\n\n")[0]), "fields": _fields(kind)}
        for name, kind in sorted(known.items())
    }


def _plain(text: str) -> str:
    """Return a text of a docstring on one line, without marks."""
    return " ".join(_MARKED.sub(lambda each: each[1].rpartition(".")[2], text).replace("``", "").split())


def _fields(kind: type) -> dict[str, dict[str, Any]]:
    meanings: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        meanings |= _documented(each)
    result = {}
    for field in dataclasses.fields(kind):
        if not field.init:
            continue
        given, made = field.default, field.default_factory
        optional = given is not dataclasses.MISSING or made is not dataclasses.MISSING
        default = given if given is not dataclasses.MISSING else "as declared" if optional else None
        plain = default if isinstance(default, (int, float, str, type(None))) else str(default)
        result[field.name] = {
            "meaning": meanings.get(field.name, ""), "optional": optional, "default": plain,
        }  # fmt: skip
    return result


def _documented(kind: type) -> dict[str, str]:
    """Return what the docstring of a class says of its parameters."""
    text = inspect.cleandoc(kind.__dict__.get("__doc__") or "")
    _, mark, section = text.partition("Parameters\n----------\n")
    section = re.split(r"\n\n(?=\w[\w ]*\n-{3,})", section)[0] + "\n"
    meanings = {}
    for match in _FIELD.finditer(section) if mark else ():
        for name in match["names"].split(", "):
            meanings[name] = _plain(match["text"])
    return meanings
