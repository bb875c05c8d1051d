"""C structures with members named as the variables: ``spring.rubber.relaxing.dashpot.strain``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from ...foundation.errors import ExportError
from ...model.flat import Variable
from .c_text import Real, comment, identifier


@dataclass
class _Branch:
    leaf: Variable | None = None
    branches: dict[str, _Branch] = field(default_factory=dict)


def _tree(variables: Iterable[Variable]) -> _Branch:
    root = _Branch()
    for variable in variables:
        here = root
        for member in variable.name.split("."):
            here = here.branches.setdefault(_member(member), _Branch())
        if here.leaf is not None:
            raise ExportError(
                f"'{here.leaf.name}' and '{variable.name}'",
                "become the same member of a C structure",
                next_step="rename one of them",
            )
        here.leaf = variable
    return root


def _leaf_name(member: str, branch: _Branch) -> str:
    # A name that is also a prefix of longer names gets a trailing underscore.
    return member + "_" if branch.branches else member


def member_paths(variables: Sequence[Variable]) -> dict[str, str]:
    """Return the C path of each variable inside its structure.

    Parameters
    ----------
    variables
        All variables of the structure.

    Raises
    ------
    ExportError
        If two names become the same member.
    """
    paths: dict[str, str] = {}

    def walk(branch: _Branch, path: str) -> None:
        for member, below in branch.branches.items():
            if below.leaf is not None:
                paths[below.leaf.name] = path + _leaf_name(member, below)
            walk(below, f"{path}{member}.")

    walk(_tree(variables), "")
    return {variable.name: paths[variable.name] for variable in variables}


def structure(
    name: str, variables: Sequence[Variable], real: Real, title: str, *, numbered: bool = False
) -> list[str]:
    """Return the lines of one ``typedef struct``.

    Parameters
    ----------
    name
        Name of the type.
    variables
        Its members.
    real
        Number type.
    title
        Description of the structure.
    numbered
        Whether the members are numbered in the order of the model.
    """
    numbers = {each.name: f"{i}: " if numbered else "" for i, each in enumerate(variables)}
    lines = [f"/* {comment(title)} */", "typedef struct {"]
    if not variables:
        lines.append("    char none; /* C99 knows no empty structure */")

    def walk(branch: _Branch, indent: str) -> None:
        for member, below in branch.branches.items():
            if below.leaf is not None:
                remark = numbers[below.leaf.name] + _remark(below.leaf)
                lines.append(f"{indent}{real.name} {_leaf_name(member, below)}; /* {remark} */")
            if below.branches:
                lines.append(f"{indent}struct {{")
                walk(below, indent + "    ")
                lines.append(f"{indent}}} {member};")

    walk(_tree(variables), "    ")
    return [*lines, f"}} {name};"]


def initialiser(variables: Sequence[Variable], real: Real) -> list[str]:
    """Return designated initialisers with the start values of variables.

    Parameters
    ----------
    variables
        Members of the structure.
    real
        Number type.
    """
    if not variables:
        return [".none = 0"]
    paths = member_paths(variables)
    return [f".{paths[each.name]} = {real.literal(each.start)}," for each in variables]


def _remark(variable: Variable) -> str:
    limits = ""
    if variable.minimum > -float("inf") or variable.maximum < float("inf"):
        limits = f", {variable.minimum:.6g} to {variable.maximum:.6g}"
    source = f"; {variable.source}" if variable.source else ""
    return comment(f"[{variable.unit}{limits}] {variable.description}{source}")


def _member(text: str) -> str:
    return identifier(re.sub(r"\[(\d+)\]$", r"_\1", text))
