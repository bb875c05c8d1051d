"""C structures whose members are called as the variables are: ``spring.rubber.relaxing.dashpot.strain``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from ...errors import ExportError
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
        for word in variable.name.split("."):
            here = here.branches.setdefault(_word(word), _Branch())
        if here.leaf is not None:
            raise ExportError(
                f"'{here.leaf.name}' and '{variable.name}'",
                "become the same member of a C structure",
                next_step="rename one of them",
            )
        here.leaf = variable
    return root


def _leaf_name(word: str, branch: _Branch) -> str:
    # A name that is also the beginning of longer ones ends in an underscore.
    return word + "_" if branch.branches else word


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
        for word, below in branch.branches.items():
            if below.leaf is not None:
                paths[below.leaf.name] = path + _leaf_name(word, below)
            walk(below, f"{path}{word}.")

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
        What the structure holds.
    numbered
        Whether the members are numbered in the order of the model.
    """
    numbers = {each.name: f"{i}: " if numbered else "" for i, each in enumerate(variables)}
    lines = [f"/* {comment(title)} */", "typedef struct {"]
    if not variables:
        lines.append("    char none; /* C99 knows no empty structure */")

    def walk(branch: _Branch, indent: str) -> None:
        for word, below in branch.branches.items():
            if below.leaf is not None:
                remark = numbers[below.leaf.name] + _remark(below.leaf)
                lines.append(f"{indent}{real.name} {_leaf_name(word, below)}; /* {remark} */")
            if below.branches:
                lines.append(f"{indent}struct {{")
                walk(below, indent + "    ")
                lines.append(f"{indent}}} {word};")

    walk(_tree(variables), "    ")
    return [*lines, f"}} {name};"]


def initialiser(variables: Sequence[Variable], real: Real, indent: str = "    ") -> list[str]:
    """Return designated initialisers with the start values of variables.

    Parameters
    ----------
    variables
        Members of the structure.
    real
        Number type.
    indent
        Blanks before each line.
    """
    if not variables:
        return [f"{indent}.none = 0"]
    paths = member_paths(variables)
    return [f"{indent}.{paths[each.name]} = {real.literal(each.start)}," for each in variables]


def _remark(variable: Variable) -> str:
    limits = ""
    if variable.minimum > -float("inf") or variable.maximum < float("inf"):
        limits = f", {variable.minimum:.6g} to {variable.maximum:.6g}"
    source = f"; {variable.source}" if variable.source else ""
    return comment(f"[{variable.unit}{limits}] {variable.description}{source}")


def _word(text: str) -> str:
    return identifier(re.sub(r"\[(\d+)\]$", r"_\1", text))
