"""What is asked of each point: a question is an object, and any pure function of an assembly is one."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import inspect
import math
import pickle
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..components.assembly.named_parts import Assembly
from ..foundation.errors import ValueRangeError, WorkSharingError, brief
from ..foundation.quantity import Quantity
from .axis_values import ASK, changed_assembly, with_settings
from .sweep_columns import SweepColumn


class SweepQuestion(ABC):
    """A pure function from an assembly to numbers by name; a frozen dataclass, so that axes can change it."""

    @abstractmethod
    def answers(self, assembly: Assembly) -> tuple[SweepColumn, ...]:
        """Return the columns of the answers, in SI.

        Parameters
        ----------
        assembly
            That is swept, unchanged.
        """

    @abstractmethod
    def ask(self, assembly: Assembly) -> Mapping[str, float]:
        """Return the answers by name, in SI.

        Parameters
        ----------
        assembly
            Of the point.

        Raises
        ------
        NlsError
            If there is no answer; its message is kept as the reason.
        """

    def require_fit(self, assembly: Assembly) -> None:
        """Refuse what the question names and an assembly does not have, before anything is computed.

        Parameters
        ----------
        assembly
            Of a point.

        Raises
        ------
        NlsError
            If the question could not be asked of it.
        """
        del assembly

    def chosen(self, assembly: Assembly) -> frozenset[str]:
        """Return the numbers that the question chooses itself, so that no axis can change them.

        Parameters
        ----------
        assembly
            That is swept, unchanged.
        """
        del assembly
        return frozenset()

    def describe(self) -> str:
        """Return what is asked as a text that changes when the question does."""
        return f"{type(self).__qualname__}({_described(self)})"

    def stands_for(self, name: str, text: str) -> str:
        """Return what a word of an axis stands for, as a text that changes with it; empty for a mere word.

        Parameters
        ----------
        name
            Of the axis.
        text
            One of its words, such as the name of a folder.

        Raises
        ------
        NlsError
            If it stands for something that is not there.
        """
        del name, text
        return ""


@dataclass(frozen=True)
class FunctionQuestion(SweepQuestion):
    """A function of one's own.

    Parameters
    ----------
    function
        Picklable and pure: from an assembly to numbers in SI by name.
    units
        Unit in SI of each answer by name; ``""`` for a pure number.
    """

    function: Callable[[Assembly], Mapping[str, float]]
    units: Mapping[str, str]

    def answers(self, assembly: Assembly) -> tuple[SweepColumn, ...]:
        """Return one column for each unit."""
        name = getattr(self.function, "__name__", type(self.function).__name__)
        return tuple(answer(key, unit, f"of {name}") for key, unit in self.units.items())

    def ask(self, assembly: Assembly) -> Mapping[str, float]:
        """Return what the function answers."""
        return self.function(assembly)

    def describe(self) -> str:
        """Return name and source of the function with what it holds, and the units."""
        return f"{type(self).__qualname__}({source_of(self.function)}, {sorted(self.units.items())})"


def answer(name: str, unit: str, description: str) -> SweepColumn:
    """Return the column of an answer.

    ``name``, ``unit``, ``description``: as for a column; the unit in SI.
    """
    return SweepColumn(name, "" if unit == "1" else unit, description, "answer")


@dataclass(frozen=True)
class PointWork:
    """What a worker does with a point."""

    assemblies: Mapping[str, Assembly]  # by the name of their deck
    question: SweepQuestion  # what is asked
    axes: tuple[tuple[str, str], ...]  # names and units of the values of a point
    answers: tuple[str, ...]  # names of the answers

    def __call__(self, values: tuple[Any, ...]) -> tuple[float, ...]:
        """Return the answers of a point."""
        question, assembly = self.at(values)
        given = question.ask(assembly)
        if not isinstance(given, Mapping) or set(given) != set(self.answers):
            shown = sorted(given) if isinstance(given, Mapping) else brief(given)
            raise ValueRangeError(
                "question", f"answered {shown}, {sorted(self.answers)} were announced",
                next_step="return a number for each name of the units",
            )  # fmt: skip
        return tuple(_number(name, given[name]) for name in self.answers)

    def at(self, values: tuple[Any, ...]) -> tuple[SweepQuestion, Assembly]:
        """Return the question of a point, and the assembly of which it is asked."""
        named = {name: value for (name, _), value in zip(self.axes, values, strict=True)}
        asked = {name: value for name, value in named.items() if name.startswith(f"{ASK}.")}
        question = with_settings(self.question, asked, dict(self.axes)) if asked else self.question
        return question, changed_assembly(self.assemblies, named)


def _number(name: str, value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ValueRangeError(f"answer '{name}' = {brief(value)}", "is not a number") from None


def worst(values: Any, *, of: Callable[[Any], Any]) -> float:
    """Return the least or largest of numbers, not a number where one of them is none."""
    numbers = [float(each) for each in values]
    return math.nan if not numbers or any(math.isnan(each) for each in numbers) else float(of(numbers))


def _described(value: Any) -> str:
    """Return a dataclass as a text that holds every number of it."""
    if isinstance(value, Quantity):
        return repr((value.value, value.unit))
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        inner = ((f.name, getattr(value, f.name)) for f in dataclasses.fields(value))
        return f"{type(value).__qualname__}({', '.join(f'{name}={_described(v)}' for name, v in inner)})"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {_described(value[key])}" for key in sorted(value, key=repr)) + "}"
    if isinstance(value, (tuple, list)):
        return "(" + ", ".join(map(_described, value)) + ")"
    if value is None or isinstance(value, str | int | float | bool):
        return repr(value)
    if isinstance(value, Path):
        return repr(value.as_posix())
    return source_of(value) if callable(value) else _pickled(value)


def _pickled(value: Any) -> str:
    try:
        return hashlib.sha256(pickle.dumps(value, protocol=4)).hexdigest()
    except Exception as error:
        raise WorkSharingError(
            f"question: {brief(value)}", f"cannot be pickled ({error})",
            next_step="take a function of a module, without open files, locks or connections",
        ) from None  # fmt: skip


def source_of(function: Callable[..., Any]) -> str:
    """Return name and source of a function with what it holds, so that a change of it is noticed.

    The whole file counts in which it stands, since functions call their neighbours.
    """
    if isinstance(function, functools.partial):
        given = f"{_described(function.args)}, {_described(function.keywords)}"
        return f"partial({source_of(function.func)}, {given})"
    kind = function if inspect.isroutine(function) else type(function)
    held: list[Any] = []
    if inspect.isfunction(function):
        held = [function.__defaults__ or (), function.__kwdefaults__ or {}]
        held += [cell.cell_contents for cell in function.__closure__ or ()]
    elif inspect.ismethod(function):
        held = [getattr(function.__self__, "__dict__", {})]
    elif not inspect.isroutine(function):
        held = [getattr(function, "__dict__", {})]
    code = hashlib.sha256(_source(kind)).hexdigest()
    return f"{getattr(kind, '__qualname__', kind)}:{code}:{_described(held)}"


def _source(kind: Any) -> bytes:
    try:
        path = inspect.getsourcefile(kind)
        if path is not None and Path(path).is_file():
            return Path(path).read_bytes()
        return inspect.getsource(kind).encode()
    except (OSError, TypeError):  # typed into a session, or compiled
        code = getattr(kind, "__code__", None)
        return repr((code.co_code, code.co_consts)).encode() if code is not None else repr(kind).encode()
