"""Options that several commands offer."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .typed_values import Bytes, NamedPath, Number, TimeBudget

if TYPE_CHECKING:
    from ..components import Assembly
    from ..model import FlatModel

F = TypeVar("F", bound=Callable[..., Any])

spring_option = click.option(
    "--spring", default=None, metavar="PART", help="The series spring, where the deck leaves it open."
)
measured_option = click.option(
    "--measured",
    default=None,
    metavar="STATE",
    help="What is measured; by default the motion of the driven body.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
DECK_HELP = "Deck file, or the name of one that comes with the project."
deck_option = click.option("--deck", "deck_name", required=True, metavar="DECK", help=DECK_HELP)
mapping_option = click.option(
    "--mapping", type=NamedPath(dir_okay=False), default=None, help="TOML that maps columns to signals."
)
hold_out_option = click.option(
    "--hold-out", multiple=True, help="Glob of record names that no fit may use; repeatable."
)
joint_option = click.option(
    "--joint", default=None, metavar="NAME", help="Joint of a log of a robot: read only its columns."
)
sample_time_option = click.option(
    "--sample-time", type=Number("ms", above=0.0, up_to=1.0), default="1 ms", show_default=True,
    help="Of what is computed in steps.",
)  # fmt: skip
real_option = click.option(
    "--real",
    type=click.Choice(["double", "float"]),
    default="double",
    show_default=True,
    help="Type of the numbers in C.",
)
export_option = click.option(
    "--export",
    "exports",
    is_flag=True,
    help="Write observer, controller and both as one step from the better deck as C, and all as FMUs.",
)

BEST, CASCADE, CERTIFIED = "best", "cascade", "certified"
KINDS = (BEST, "corrected", CASCADE, CERTIFIED, "kalman", "published")
"""As :data:`nlsdesign.feedback.observer.spread.choice.KINDS`, which is not loaded for an option."""
kind_option = click.option(
    "--kind",
    type=click.Choice(KINDS),
    default=None,
    help="best: least expected error over the spread of the deck; the default. corrected: the cascade, its "
    "torque corrected by what the drive shows. cascade: rubber driven by the measured angle, at the declared "
    "numbers. certified: the same structure with one gain that is proved for every angle. kalman: "
    "steady-state Kalman filter at each angle, with noise from the deck's sensors and assumed disturbances. "
    "published: states of Austin et al. 2015, with the gain of the cascade or, by --fit-poles, with poles "
    "fitted to records.",
)


def machine_of(deck_name: str) -> Assembly:
    """Return the machine that a deck declares: a file, or the name of one that comes with the project."""
    from ..components import declare
    from ..foundation.deck import load_deck

    return declare(load_deck(deck_name))


def workers_option(command: F) -> F:
    """Return a command with the option ``--workers``; its results do not depend on it."""

    @functools.wraps(command)
    def shared(*words: Any, **given: Any) -> Any:
        from ..foundation.work_sharing import Processes, spread_over

        workers = given.pop("workers")
        with contextlib.nullcontext() if workers is None else spread_over(Processes(workers)):
            return command(*words, **given)

    option = click.option(
        "--workers", type=click.IntRange(min=1), default=None, metavar="NUMBER",
        help="Processes of this machine that share the work, by default one for each core, at most four; the "
        "result is the same.",
    )  # fmt: skip
    result: F = option(shared)  # type: ignore[assignment]
    return result


def flash_options(command: F) -> F:
    """Add ``--flash``, ``--budget`` and ``--table-error``."""
    command = click.option(
        "--flash", type=Bytes(), metavar="SIZE",
        help="Most flash of code and tables on a Cortex-M4F, for instance 16kB; the table is made coarser "
        "for it, and what that costs is said.",
    )(command)  # fmt: skip
    command = click.option(
        "--budget", type=TimeBudget(), metavar="SHARE@CLOCK",
        help="Most time of a step on a Cortex-M4F, for instance 20%@80MHz of the sample time; counted by "
        "qemu-system-arm, one cycle an instruction.",
    )(command)  # fmt: skip
    return click.option(
        "--table-error", type=Number("N*m", above=0.0), metavar="TORQUE",
        help="Torque error that the table may cause, for instance 1mN.m.  [default: 0.02 % of the largest "
        "torque]",
    )(command)  # fmt: skip


LAWS = {
    "scheduled": "controller.bandwidth", "pid": "controller.proportional",
    "reproduced": "controller.proportional",
}  # fmt: skip
"""Number of the controller that decides its margins, by law."""
_LAW = click.option(
    "--law",
    type=click.Choice(list(LAWS)),
    default="scheduled",
    show_default=True,
    help="Of the controller: speed by tangent stiffness; a PID with the gain that the spring allows; or the "
    "PID with which the studies reproduce the published loop, Kp 32, which has little margin.",
)
bandwidth_option = click.option(
    "--bandwidth",
    type=Number("Hz", above=0.0),
    default=None,
    help="Of the scheduled law; by default 12 Hz at 1 kHz.",
)
_VELOCITY_BANDWIDTH = click.option(
    "--velocity-bandwidth",
    type=Number("Hz", above=0.0),
    default=None,
    help="Of the velocity loop inside; by default 45 Hz at 1 kHz.",
)


def law_options(command: F) -> F:
    """Add the options that choose the law of a torque controller."""
    return _LAW(bandwidth_option(_VELOCITY_BANDWIDTH(command)))


def controller_of(
    plant: FlatModel,
    sample_time: float,
    *,
    law: str,
    bandwidth: float | None,
    velocity_bandwidth: float | None,
) -> tuple[FlatModel, str]:
    """Return the torque controller that the options of a command ask for, and a sentence on its margins.

    A gain that nobody has given is lowered to one that has them.
    """
    from ..feedback.control import with_margin
    from ..regeneration import usual_last

    return with_margin(
        plant, LAWS[law], last=usual_last(plant), given=law == "reproduced" or bandwidth is not None,
        sample_time=sample_time, **law_of(law, bandwidth, velocity_bandwidth),
    )  # fmt: skip


def law_of(law: str, bandwidth: float | None, velocity_bandwidth: float | None) -> dict[str, Any]:
    """Return what a torque controller is made of, as arguments of its function."""
    from ..feedback.control import REPRODUCED_GAINS, PidTorque, ScheduledTorque, VelocityLoop

    if law != "scheduled" and bandwidth is not None:
        raise click.BadParameter("a PID has gains and no bandwidth; leave it out, or take --law scheduled")
    if law == "reproduced":
        if velocity_bandwidth is None:
            return {"gains": REPRODUCED_GAINS}
        return {"gains": replace(REPRODUCED_GAINS, velocity_bandwidth=velocity_bandwidth)}
    outer = ScheduledTorque(bandwidth=bandwidth) if law == "scheduled" else PidTorque()
    return {"law": outer, "velocity": VelocityLoop(bandwidth=velocity_bandwidth)}
