"""Which spots of a file are broken, and how; the mutations are those of the library cosmic-ray."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Changes of sign, of order and of decision; not every pair of operators, which would ask the same again.
OPERATORS = (
    "ReplaceBinaryOperator_Add_Sub",
    "ReplaceBinaryOperator_Sub_Add",
    "ReplaceBinaryOperator_Mul_Div",
    "ReplaceBinaryOperator_Div_Mul",
    "ReplaceComparisonOperator_Lt_GtE",
    "ReplaceComparisonOperator_LtE_Gt",
    "ReplaceComparisonOperator_Gt_LtE",
    "ReplaceComparisonOperator_GtE_Lt",
    "ReplaceComparisonOperator_Eq_NotEq",
    "ReplaceComparisonOperator_NotEq_Eq",
    "ReplaceUnaryOperator_Delete_USub",
    "ReplaceUnaryOperator_Delete_Not",
    "AddNot",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ZeroIterationForLoop",
)


@dataclass(frozen=True)
class Mutant:
    """One change of one file.

    Parameters
    ----------
    file
        Relative to the project.
    operator
        Name of the mutation.
    occurrence
        Which of the places that it fits, counted from zero.
    line
        Line of the file.
    first, last
        Lines of the statement, or of the head of a block: a test that reaches one of them reaches the change.
    """

    file: str
    operator: str
    occurrence: int
    line: int
    first: int
    last: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line} {self.operator} #{self.occurrence}"


def mutants_of(root: Path, file: str) -> Iterator[Mutant]:
    """Yield every mutant of a file.

    Parameters
    ----------
    root
        Folder of the project.
    file
        Relative to it.
    """
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.util import read_python_source

    tree = get_ast(read_python_source(root / file))
    leaves = {
        node.start_pos: node for node in ast_nodes(tree) if not hasattr(node, "children") and node.value
    }
    for name, operator in _operators().items():
        occurrence = 0
        for node in ast_nodes(tree):
            for start, _ in operator.mutation_positions(node):
                leaf = leaves[start]
                if _does_something(leaf):
                    whole = _statement(leaf)
                    yield Mutant(file, name, occurrence, start[0], whole.start_pos[0], whole.end_pos[0])
                occurrence += 1


def broken(root: Path, mutant: Mutant) -> str:
    """Return the text of a file with one change in it.

    Parameters
    ----------
    root
        Folder of the project.
    mutant
        What to change.
    """
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.util import read_python_source

    text: str = mutate_code(
        read_python_source(root / mutant.file), _operators()[mutant.operator], mutant.occurrence
    )
    return text


def _operators() -> dict[str, Any]:
    from cosmic_ray.operators.operator import Operator
    from cosmic_ray.operators.provider import OperatorProvider

    class SwapMinMax(Operator):  # type: ignore[misc]
        """Put max for min and the other way round, also ``fmin`` and ``fmax``."""

        swapped = {"min": "max", "max": "min", "fmin": "fmax", "fmax": "fmin"}  # noqa: RUF012

        def mutation_positions(self, node: Any) -> Iterator[tuple[Any, Any]]:
            if node.type == "name" and node.value in self.swapped and _is_called(node):
                yield node.start_pos, node.end_pos

        def mutate(self, node: Any, index: int) -> Any:
            node.value = self.swapped[node.value]
            return node

        @classmethod
        def examples(cls) -> tuple[Any, ...]:
            return ()

    provider = OperatorProvider()
    return {name: provider[name]() for name in OPERATORS} | {"SwapMinMax": SwapMinMax()}


_SIGNATURE = ("parameters", "lambdef", "arglist", "trailer")
"""Where a star marks arguments and multiplies nothing."""
_BODIES = ("suite", "file_input", "simple_stmt", "if_stmt", "while_stmt", "for_stmt", "with_stmt")


def _does_something(leaf: Any) -> bool:
    """Tell whether a leaf matters at run time: not in annotations, nor as a mark of arguments."""
    if leaf.value in ("*", "/") and leaf.parent.type in _SIGNATURE:
        return False
    if leaf.value == "TYPE_CHECKING":
        return False
    child, node = leaf, leaf.parent
    while node is not None:
        if node.type == "annassign" and child is node.children[1]:
            return False
        if node.type == "tfpdef" and child is node.children[-1]:
            return False
        if node.type == "funcdef" and child is node.annotation:
            return False
        child, node = node, node.parent
    return True


def _statement(leaf: Any) -> Any:
    """Return the statement that holds a leaf, or the part of a compound one, without its body."""
    node = leaf
    while node.parent is not None and node.parent.type not in _BODIES:
        node = node.parent
    return node


def _is_called(name: Any) -> bool:
    following = name.get_next_leaf()
    return following is not None and following.value == "("
