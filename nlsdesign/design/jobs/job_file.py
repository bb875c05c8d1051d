"""A design file in TOML: target, what is free, limits, goals, stock, search; see :func:`read_job`.

A target that follows from a task: read from a design file, made for the motor of the deck.
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from ...foundation.deck import Deck, read_deck
from ...foundation.errors import (
    DeckError,
    InfeasibleError,
    NlsError,
    UnitError,
    ValueRangeError,
    brief,
    unknown_name,
)
from ...foundation.quantity import Quantity, quantity
from ...foundation.text_files import text_of
from ...foundation.written_numbers import split_number
from ...model import FlatModel
from ..curves.beside import SpringChoice, choose_spring
from ..curves.compliance import OddSpring, SpringSymmetry
from ..curves.motor_and_gear import motor_and_gear
from ..curves.numbers import in_si
from ..curves.target import TabulatedTorque, Target
from ..curves.target_files import read_band, read_target
from ..curves.task import read_task, walking_task
from ..curves.task_curve import LeastEnergy, TaskGoal, TaskProblem
from ..optimisation.defaults import DesignSettings
from ..optimisation.goals import Goal
from ..optimisation.limits import Limit, TorqueWithin
from ..optimisation.solve import GOALS
from ..optimisation.stock import CoilStock, RubberStock, Stock, StockChoice


@dataclass(frozen=True, kw_only=True)
class TaskTarget:
    """The torque curve of least motor energy, or peak power, for a task.

    Parameters
    ----------
    file
        Record of one period, beside the design file; see :func:`~nlsdesign.design.read_task`.
    joint
        Instead of a file: ``"ankle"``, ``"knee"`` or ``"hip"`` in walking.
    body_mass
        Mass of the body in kg, where the torques are stated per body mass.
    scale
        Share of the torque that the actuator gives.
    gear_ratio
        Another gear ratio than the declared one, a pure number.
    goal
        What is made small over the task: ``LeastEnergy`` or ``LeastPeakPower``.
    symmetry
        ``OddSpring``, ``OneSidedSpring`` or ``TwoBranchSpring``; of a spring in series.
    gear_ratios
        Instead of one: the least and the greatest, of which the best is found together with the spring.
    place
        ``"series"``, or ``"beside"`` for one from joint to frame that acts beyond an angle, in one direction.

    Raises
    ------
    UnknownNameError
        If there is no such place.
    ValueRangeError
        If the range of the gear ratio is none, or neither a file nor a joint is given, or both are.
    """

    file: str = ""
    joint: str = ""
    body_mass: Quantity | float | None = None
    scale: Quantity | float = 1.0
    gear_ratio: Quantity | float | None = None
    goal: TaskGoal = field(default_factory=LeastEnergy)
    symmetry: SpringSymmetry = field(default_factory=OddSpring)
    gear_ratios: tuple[Quantity | float, ...] = ()
    place: str = "series"

    def __post_init__(self) -> None:
        if self.place not in _PLACES:
            raise unknown_name("task: place", self.place, _PLACES)
        if self.gear_ratios and (len(self.gear_ratios) != 2 or self.gear_ratio is not None):
            raise ValueRangeError(
                "task: gear_ratios", "is the least and the greatest, and stands instead of gear_ratio",
                next_step="write gear_ratios = [20.0, 120.0]",
            )  # fmt: skip
        if bool(self.file) == bool(self.joint):
            raise ValueRangeError(
                "task", "needs a file or a joint, and not both",
                next_step='write file = "task.csv", or joint = "ankle" with body_mass = "75 kg"',
            )  # fmt: skip
        in_si("scale", self.scale, "1", minimum=1e-6, maximum=1e3)

    def choice(self, model: FlatModel, folder: Path) -> SpringChoice:
        """Return what springs in each place do for the motor of a model.

        Parameters
        ----------
        model
            Flat model of the actuator.
        folder
            Of the design file.

        Raises
        ------
        ValueRangeError
            If the body mass is missing, or a number is out of range.
        NlsError
            If the task cannot be read, the motor declares too little, or no spring keeps its limits.
        """
        if self.file:
            task = read_task(folder / self.file, body_mass=self.body_mass)
        else:
            mass = self.body_mass
            if mass is None:
                raise ValueRangeError(
                    "task: body_mass", "is missing; the tables are per body mass",
                    next_step='write body_mass = "75 kg"',
                )  # fmt: skip
            task = walking_task(self.joint, body_mass=mass)
        drive = motor_and_gear(model)
        if self.gear_ratio is not None:
            drive = drive.geared(in_si("gear_ratio", self.gear_ratio, "1", minimum=1e-3, maximum=1e4))
        ratios = (self.gear_ratios[0], self.gear_ratios[1]) if self.gear_ratios else None
        problem = TaskProblem(goal=self.goal, symmetry=self.symmetry, gear_ratios=ratios)
        return choose_spring(task.scaled(in_si("scale", self.scale, "1")), drive, problem)

    def target(self, choice: SpringChoice) -> TabulatedTorque:
        """Return the curve of the spring in the place that is asked for.

        Parameters
        ----------
        choice
            Of this task.

        Raises
        ------
        InfeasibleError
            If no spring in that place keeps the limits, or one beside the drive would not help.
        """
        if self.place == "series" and choice.series:
            return choice.series.target
        if self.place == "beside" and choice.beside and choice.beside.sides:
            return choice.beside.sides[0].target
        raise InfeasibleError(
            f"task: a spring with place = '{self.place}'",
            "keeps no limit or does not help",
            next_step=f"take the other place, or another motor or gear ratio. {choice.reason}",
        )


_PLACES = ("series", "beside")


Asked = TypeVar("Asked")

_TABLES = (
    "spring",
    "free",
    "target",
    "back_target",
    "limits",
    "goals",
    "stock",
    "search",
    "tolerance",
    "drawing",
)
DRAWS = 1000
_NO_FILE = Deck("", "", Path("design"), {}, {})
_SEARCH = ("starts", "seed", "largest_error")


@dataclass(frozen=True, eq=False)
class DesignJob:
    """What is asked of a design.

    Parameters
    ----------
    path
        File that it was read from.
    target
        Torque curve, or the task that it follows from.
    free
        Names and stocks; ``None`` for the contour alone.
    keep
        Limits.
    goals
        What is made small.
    spring
        Path of the cam spring, where it was named.
    settings
        Of the search.
    drawing
        The table of that name, as read.
    back
        Torque curve for negative angles with both signs turned, of a cam whose sides differ.
    deck
        The whole file with the places of its names, where there is one.
    """

    path: Path
    target: Target | TaskTarget
    free: tuple[str | StockChoice, ...] | None
    keep: tuple[Limit, ...]
    goals: tuple[Goal, ...]
    spring: str | None
    settings: DesignSettings
    drawing: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    back: Target | None = None
    deck: Deck = _NO_FILE


def read_job(path: Path | str) -> DesignJob:
    """Read a design file; see :func:`job_of` for what stands in it.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    DeckError
        If the file cannot be read.
    NlsError
        As for :func:`job_of`.
    """
    file = Path(path)
    return job_of(text_of(file, DeckError, next_step="give a design file in TOML, UTF-8"), file)


def job_of(text: str, file: Path) -> DesignJob:
    """Read what is asked of a design.

    Each limit and goal is a line ``Name = {field = "number unit"}`` under ``[limits]`` or ``[goals]``, with
    the names and fields of the Python objects; the target is one such line under ``[target]``, or
    ``file = "curve.csv"`` (beside the design file), which may hold a band too. Numbers carry their
    unit; bare ones are pure numbers, or rows in SI.

    Examples
    --------
    A file::

        free = ["spring.cam.contour", "spring.pretension"]

        [target]
        ExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0}
        # or: file = "curve.csv"
        # or: TaskTarget = {joint = "ankle", body_mass = "75 kg", scale = 0.05, gear_ratio = 80.0}

        [limits]
        MaximumCamRadius = {radius = "20 mm"}

        [stock]
        "spring.rubber.thickness" = ["2 mm", "3 mm"]
        rubber = ["PMC-770"]
        coil = "coils.csv"
        [search]
        starts = 20
        largest_error = "1 %"
        [tolerance]
        draws = 2000
    """
    return job_in(read_deck(text, file))


def job_in(deck: Deck) -> DesignJob:
    """Return what is asked of a design by tables that were read; see :func:`job_of`."""
    file = deck.path
    for key in deck.tables:
        if key not in _TABLES:
            raise unknown_name(deck.place(key), key, _TABLES)
    if "target" not in deck.tables:
        raise DeckError(
            deck.place("target") if deck.stands_in else file.name, "has no target",
            next_step=f"write [{deck.named('target')}] and below it PowerTorque = {{coefficient = ..., ...}} "
                      'or file = "..."',
        )  # fmt: skip
    free = _names(deck, "free")
    target, band = _target(deck)
    stock = tuple(_stock(deck, "stock", _table(deck, "stock")))
    table = _table(deck, "search")
    values: dict[str, Any] = {}
    for name, raw in table.items():
        place = deck.place(f"search.{name}")
        if name not in _SEARCH:
            raise unknown_name(place, name, _SEARCH)
        given = _number(raw, place).number if isinstance(raw, str) else _plain(raw, place)
        if name != "largest_error" and given != int(given):
            raise DeckError(place, f"{brief(raw)} is not a whole number")
        values[name] = float(given) if name == "largest_error" else int(given)
    # The number of made springs that the table ``[tolerance]`` asks for.
    tolerance = _table(deck, "tolerance")
    for entry in tolerance:
        if entry != "draws":
            raise unknown_name(deck.place(f"tolerance.{entry}"), entry, ["draws"])
    draws = tolerance.get("draws", DRAWS)
    if not isinstance(draws, int) or isinstance(draws, bool):
        raise DeckError(deck.place("tolerance.draws"), f"{brief(draws)} is not a whole number")
    values["draws"] = draws
    return DesignJob(
        path=file,
        target=target,
        free=None if free is None and not stock else (*(free or ()), *stock),
        keep=(*_objects(deck, "limits", Limit), *band),  # type: ignore[type-abstract]
        goals=tuple(_objects(deck, "goals", Goal)) or GOALS,  # type: ignore[type-abstract]
        spring=None if "spring" not in deck.tables else str(deck.tables["spring"]),
        settings=_placed(lambda: DesignSettings(**values), deck.place("search")),
        drawing=_table(deck, "drawing"),
        back=back_of(_target(deck, "back_target")[0]) if "back_target" in deck.tables else None,
        deck=deck,
    )


def kinds(base: type) -> dict[str, type]:
    """Return the classes that can be named in a design file, by name."""
    result: dict[str, type] = {}
    kind: type
    for kind in base.__subclasses__():
        if not getattr(kind, "__abstractmethods__", None):
            result[kind.__name__] = kind
        result |= kinds(kind)
    return dict(sorted(result.items()))


def back_of(target: Target | TaskTarget) -> Target:
    """Return the target of a side, which is a curve."""
    if isinstance(target, Target):
        return target
    raise DeckError("back_target", "is a task", next_step="give a curve, one for each side of the cam")


def _target(deck: Deck, key: str = "target") -> tuple[Target | TaskTarget, tuple[Limit, ...]]:
    """Return the target, and the band that stands beside it in its file."""
    table = _table(deck, key)
    if len(table) != 1:
        rule = f"has {len(table)} entries, a design has one target" if table else "none is given"
        raise DeckError(
            deck.place(key), rule,
            next_step=f'{"keep" if table else "write"} one of: file = "...", '
                      f'TaskTarget, {", ".join(kinds(Target))}',
        )  # fmt: skip
    ((name, given),) = table.items()
    if name == "file":
        return target_of_file(deck.path.parent / str(given))
    if name == "TaskTarget":
        return built(deck, TaskTarget, given, deck.place(f"{key}.TaskTarget")), ()
    (target,) = _objects(deck, key, Target)  # type: ignore[type-abstract]
    return target, ()


def read_entries(text: str, base: type[Asked], origin: str) -> list[Asked]:
    """Return the objects of one entry ``NAME = {field = "number unit"}``, as it stands in a design file."""
    deck = read_deck(text, Path(origin))
    return list(_of_kinds(deck, "", base, deck.tables))


def read_target_entry(text: str, origin: str) -> tuple[Target | TaskTarget, tuple[Limit, ...]]:
    """Return the target of one entry, and the band that stands beside it; see :func:`read_entries`."""
    deck = read_deck(text, Path(origin))
    places = {f"target.{name}": place for name, place in deck.places.items()}
    return _target(dataclasses.replace(deck, tables={"target": deck.tables}, places=places))


def read_stock(text: str, origin: str) -> list[StockChoice]:
    """Return the stock of one entry ``NAME = [...]``; raises as :func:`read_entries` does."""
    deck = read_deck(text, Path(origin))
    return list(_stock(deck, "", deck.tables))


def target_of_file(path: Path) -> tuple[Target, tuple[Limit, ...]]:
    """Return the curve of a file, and the band that stands beside it as a limit."""
    target = read_target(path)
    with path.open(encoding="utf-8-sig") as lines:
        head = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    has_band = "lower" in head and "upper" in head
    return target, (TorqueWithin(read_band(path)),) if has_band else ()


def _objects(deck: Deck, key: str, base: type[Asked]) -> Iterator[Asked]:
    """Yield the objects of a table of limits, goals or targets."""
    yield from _of_kinds(deck, key, base, _table(deck, key))


def _of_kinds(deck: Deck, key: str, base: type[Asked], table: Mapping[str, Any]) -> Iterator[Asked]:
    known = kinds(base)
    for name, given in table.items():
        place = deck.place(f"{key}.{name}" if key else name)
        if name not in known:
            raise unknown_name(place, name, known)
        for fields in given if isinstance(given, list) else [given]:
            yield built(deck, known[name], fields, place)


def built(deck: Deck, kind: type, given: object, place: str) -> Any:
    """Return the object of a table."""
    if not isinstance(given, Mapping):
        raise DeckError(
            place, f"{brief(given)} is not a table", next_step='write it as {field = "number unit", ...}'
        )
    hints = typing.get_type_hints(kind)
    fields = {f.name: f for f in dataclasses.fields(kind) if f.init}
    for name in given:
        if name not in fields:
            raise unknown_name(f"{place}: field", name, fields)
    missing = [
        name
        for name, field in fields.items()
        if name not in given
        and field.default is dataclasses.MISSING
        and field.default_factory is dataclasses.MISSING
    ]
    if missing:
        raise DeckError(place, f"lacks {', '.join(missing)}", next_step=f"fields are: {', '.join(fields)}")
    values = {name: _value(deck, hints[name], raw, f"{place}: {name}") for name, raw in given.items()}
    return _placed(lambda: kind(**values), place)


def _value(deck: Deck, hint: Any, raw: object, place: str) -> Any:
    allowed = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    if isinstance(raw, Mapping):
        # What a table stands for: an object named in it, or the fields of the one kind allowed.
        for base in (Goal, TaskGoal, SpringSymmetry):
            if base in allowed:
                return next(iter(_of_kinds(deck, place, base, raw)))
        if Limit in typing.get_args(hint):
            return tuple(_of_kinds(deck, place, Limit, raw))
        records = [each for each in allowed if isinstance(each, type) and dataclasses.is_dataclass(each)]
        named = [each for each in records if each.__name__ in raw]
        if named:
            return built(deck, named[0], raw[named[0].__name__], place)
        others = [each for each in records if each is not Quantity]
        if len(others) == 1:
            return built(deck, others[0], raw, place)
        raise DeckError(place, "is a table where a number or text is wanted")
    if isinstance(raw, list):
        of_items = typing.get_args(hint)[0] if typing.get_args(hint) else Any
        return tuple(_value(deck, of_items, item, place) for item in raw)
    if isinstance(raw, str) and (Quantity in allowed or float in allowed):
        return _number(raw, place)
    if isinstance(raw, int | float) and not isinstance(raw, bool) and Quantity in allowed:
        # A bare number is a pure one: a length without a unit is refused by what it is for.
        return Quantity(_plain(raw, place), "1", "asked for in the design file")
    if isinstance(raw, bool) and bool not in allowed:
        raise DeckError(place, f"is {str(raw).lower()} where a number or text is wanted")
    return _plain(raw, place) if isinstance(raw, float) else raw


def _plain(raw: object, place: str) -> float:
    """Return a number that stands in the file without a unit."""
    if isinstance(raw, int | float) and not isinstance(raw, bool):
        try:
            number = float(raw)
        except OverflowError:  # a whole number of hundreds of digits
            number = math.inf
        if math.isfinite(number):
            return number
    raise DeckError(place, f"{brief(raw)} is not a finite number")


def _number(text: str, place: str) -> Quantity:
    try:
        number, unit = split_number(text)
    except UnitError as error:
        step = error.next_step or "write for instance '20 mm'"
        raise UnitError(f"{place} = '{text}'", error.rule, next_step=step) from None
    return _placed(lambda: quantity(number, unit or "1", source="asked for in the design file"), place)


def _stock(deck: Deck, key: str, table: Mapping[str, Any]) -> Iterator[StockChoice]:
    for name, given in table.items():
        place = deck.place(f"{key}.{name}" if key else name)
        if name == "coil" and isinstance(given, str):
            yield CoilStock(deck.path.parent / given if key else given)
            continue
        if not isinstance(given, list):
            raise DeckError(place, "is not a list", next_step='write for instance ["2 mm", "3 mm"]')
        if name == "rubber":
            yield _placed(lambda given=given: RubberStock(tuple(str(each) for each in given)), place)  # type: ignore[misc]
            continue
        values = tuple(_number(v, place) if isinstance(v, str) else _plain(v, place) for v in given)
        yield _placed(lambda name=name, values=values: Stock(name, values), place)  # type: ignore[misc]


def _names(deck: Deck, key: str) -> tuple[str, ...] | None:
    given = deck.tables.get(key)
    if given is None:
        return None
    if not isinstance(given, list) or not all(isinstance(each, str) for each in given):
        raise DeckError(deck.place(key), "is not a list of names", next_step=f'write {key} = ["...", "..."]')
    return tuple(given)


def _table(deck: Deck, key: str) -> Mapping[str, Any]:
    given = deck.tables.get(key, {})
    if not isinstance(given, Mapping):
        raise DeckError(deck.place(key), "is not a table", next_step=f"write [{deck.named(key)}]")
    return given


Made = TypeVar("Made")


def _placed(make: Callable[[], Made], place: str) -> Made:
    """Return what is made, with its place in front of whatever is wrong with it."""
    try:
        return make()
    except NlsError as error:
        raise error.at(place) from None
    except (TypeError, OverflowError):
        # A field has a value of a kind for which none of its checks was written, such as a date.
        raise DeckError(place, "has a value of the wrong kind", next_step="write numbers and texts") from None
