"""The walk of a value: be one parameter of a function, and follow the calls that hand you on.

Nothing is run; the code is followed in the order in which it is written, one branch after the other. "I" am
the parameter, my attributes and items, and what is computed from me. I am no longer I as a text, a number or
a truth value, in a complaint about me, or as an object that is built of me (its ``__init__`` is walked),
unless the journey names its class. A call enters a function of the package where I am one of the arguments,
or where the object that it is called of has me in its attributes; what I am asked myself is answered without
a step. A function is walked through once, and only entered when it is called again. Classes are read from
annotations.

A stay is a run of entries into one file; a return is a stay in a file that was left before.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import groupby

from tests import import_graph
from tests.house.modules import Module
from tests.source import Function, arguments

Step = tuple[str, str]
"""File and name of a function that is entered."""

_PLAIN = {"str", "int", "float", "bool"}


@dataclass(frozen=True)
class Definition:
    """A function or class, the module it stands in, and the class of a method."""

    module: str
    node: Function | ast.ClassDef
    owner: Definition | None = None


def _parameters(function: Definition) -> dict[str, ast.expr | None]:
    """Return the annotations of a function by parameter."""
    assert isinstance(function.node, Function), f"{function.node.name} is a class"
    return {parameter.arg: parameter.annotation for parameter in arguments(function.node)}


def stays(steps: Iterable[Step]) -> list[str]:
    """Return the files of a walk, one for each stay."""
    return [file for file, _ in groupby(file for file, _ in steps)]


class Names:
    """What each name in the modules of a package stands for."""

    def __init__(self, every: Iterable[Module]) -> None:
        self.modules = {module.name: module for module in every}
        self.known: dict[str, dict[str, Definition | tuple[str, str]]] = {}
        for name, module in self.modules.items():
            around = name if module.file.stem == "__init__" else name.rpartition(".")[0]
            known = self.known.setdefault(name, {})
            for node in module.of_kind(ast.ImportFrom):
                base = import_graph.absolute("." * node.level + (node.module or ""), around)
                known |= {alias.asname or alias.name: (base, alias.name) for alias in node.names}
            definitions = (node for node in module.tree.body if isinstance(node, Function | ast.ClassDef))
            known |= {node.name: Definition(name, node) for node in definitions}

    def of(self, module: str, name: str) -> Definition | None:
        """Return the function or class that a name of a module stands for, through all imports."""
        found = self.known.get(module, {}).get(name)
        return self.of(*found) if isinstance(found, tuple) else found

    def class_in(self, module: str, annotation: ast.AST | None) -> Definition | None:
        """Return the last class of the package in an annotation: of a container, that of its items."""
        if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
            annotation = ast.parse(annotation.value, mode="eval").body
        words = [node.id for node in ast.walk(annotation) if isinstance(node, ast.Name)] if annotation else []
        found = [self.of(module, word) for word in reversed(words)]
        return next((one for one in found if one and isinstance(one.node, ast.ClassDef)), None)

    def member(self, owner: Definition | None, name: str) -> Definition | ast.AnnAssign | None:
        """Return a method or field of a class or of those that it is made from."""
        if owner is None or not isinstance(owner.node, ast.ClassDef):
            return None
        for node in owner.node.body:
            if isinstance(node, Function) and node.name == name:
                return Definition(owner.module, node, owner)
            if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == name:
                return node
        bases = (self.class_in(owner.module, base) for base in owner.node.bases)
        return next((found for base in bases if (found := self.member(base, name))), None)

    def journey(self, start: str, parameter: str, through: Collection[str] = ()) -> list[Step]:
        """Walk from a parameter of ``module.function`` or ``module.Class.method``."""
        around, _, name = start.rpartition(".")
        first = self.of(around, name) or self.member(self.of(*around.rpartition(".")[::2]), name)
        assert isinstance(first, Definition), f"there is no {start}"
        assert parameter in {"self", *_parameters(first)}, f"{start} has no {parameter}"
        classes = {node.name for module in self.modules.values() for node in module.of_kind(ast.ClassDef)}
        assert classes.issuperset(through), f"there is no class {set(through) - classes}"
        trip = _Trip(self, through, [])
        trip.enter(first, {parameter})
        return [(self.modules[step.module].path, step.node.name) for step in trip.entries]


@dataclass(frozen=True)
class _Trip:
    names: Names
    through: Collection[str]
    entries: list[Definition]

    def enter(self, function: Definition, me: set[str]) -> None:
        passed = function in self.entries
        self.entries.append(function)
        if not passed:
            annotations = _parameters(function).items()
            classes = {name: self.names.class_in(function.module, kind) for name, kind in annotations}
            classes |= {"self": function.owner} if function.owner else {}
            _Body(self, function.module, me, classes).follow(function.node.body)


@dataclass(frozen=True)
class _Body:
    """One function on the way: which names are me, and of which class names are."""

    trip: _Trip
    module: str
    me: set[str]
    classes: dict[str, Definition | None]

    def follow(self, statements: Iterable[ast.AST]) -> None:
        for node in statements:
            if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign) and node.value:
                self.bind(node.targets if isinstance(node, ast.Assign) else [node.target], node.value)
            elif isinstance(node, ast.For | ast.comprehension):
                self.bind([node.target], node.iter)
                self.follow(node.ifs if isinstance(node, ast.comprehension) else [*node.body, *node.orelse])
            elif isinstance(node, ast.withitem):
                self.bind([node.optional_vars] if node.optional_vars else [], node.context_expr)
            elif isinstance(node, ast.expr):
                self.mine(node)
            elif not isinstance(node, ast.ClassDef | ast.Raise):
                self.follow(ast.iter_child_nodes(node))

    def bind(self, targets: list[ast.expr], value: ast.expr) -> None:
        """Note what names mean from here on; a table into which I am put is me."""
        mine, kind = self.mine(value), self.class_of(value)
        for node in (inner for target in targets for inner in ast.walk(target)):
            if isinstance(node, ast.Subscript) and mine:
                self.me.add(ast.unparse(node.value))
            elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
                self.classes[ast.unparse(node)] = kind
                (self.me.add if mine else self.me.discard)(ast.unparse(node))

    def mine(self, node: ast.AST) -> bool:
        """Tell whether an expression is me; on the way, enter what it calls with me."""
        if isinstance(node, ast.Call):
            return self.call(node)
        if isinstance(node, ast.Name | ast.Attribute) and ast.unparse(node) in self.me:
            return True
        self.follow(getattr(node, "generators", ()))
        aside = [getattr(node, name, None) for name in ("slice", "test")]  # choose, and do not become me
        parts = [part for part in ast.iter_child_nodes(node) if not isinstance(part, ast.comprehension)]
        inner = [self.mine(part) and part not in aside for part in parts]
        return any(inner) and not isinstance(node, ast.Compare | ast.JoinedStr)

    def call(self, node: ast.Call) -> bool:
        """Enter what is called, if I am handed on; tell whether the result is me."""
        asked = isinstance(node.func, ast.Attribute) and self.mine(node.func.value)
        handed = [argument for argument in (*node.args, *node.keywords) if self.mine(argument)]
        called = self.called(node.func)
        if called is None:
            return asked or bool(handed)
        if isinstance(called.node, ast.ClassDef):
            initial = self.trip.names.member(called, "__init__")
            if isinstance(initial, Definition):
                self.hand_on(initial, node, handed, set())
            return bool(handed) and called.node.name in self.trip.through
        by_self = ast.unparse(node.func).rpartition(".")[0] == "self"
        attributes = {name for name in self.me if by_self and name.startswith("self.")}
        followed = self.hand_on(called, node, handed, {"self"} if asked else attributes)
        returned = ast.unparse(called.node.returns) if called.node.returns else ""
        return (followed or bool(handed)) and returned not in _PLAIN

    def hand_on(
        self, to: Definition, call: ast.Call, handed: list[ast.expr | ast.keyword], holder: set[str]
    ) -> bool:
        """Enter a function as those of its parameters that are me; texts and numbers are not."""
        named = _parameters(to)
        me = set()
        for argument in handed:
            name = getattr(argument, "arg", None)
            if name not in named:  # by position; the last takes what is over, *args or **kwargs
                position = call.args.index(argument) if argument in call.args else len(named)
                name = [*named, ""][min(position, max(len(named) - 1, 0))]
            annotation = named.get(name)
            plain = annotation and ast.unparse(annotation).removesuffix(" | None") in _PLAIN
            me |= {name} if name and not plain else set()
        carried = to.owner is not None and to.owner.node.name in self.trip.through
        if me or (holder if carried else holder - {"self"}):
            self.trip.enter(to, me | holder)
        return bool(me | holder)

    def called(self, expression: ast.expr) -> Definition | None:
        """Return the function, class or method of the package that an expression calls."""
        names = self.trip.names
        if isinstance(expression, ast.Name):
            return names.of(self.module, expression.id)
        if not isinstance(expression, ast.Attribute):
            return None
        base = names.known[self.module].get(ast.unparse(expression.value))
        if isinstance(base, tuple) and ".".join(base) in names.modules:
            return names.of(".".join(base), expression.attr)
        found = names.member(self.class_of(expression.value), expression.attr)
        return found if isinstance(found, Definition) else None

    def class_of(self, node: ast.AST | None) -> Definition | None:
        """Return the class of an expression, or of the items of a container."""
        names = self.trip.names
        if isinstance(node, ast.Name | ast.Attribute) and ast.unparse(node) in self.classes:
            return self.classes[ast.unparse(node)]
        if isinstance(node, ast.Attribute):
            owner = self.class_of(node.value)
            member = names.member(owner, node.attr)
            if isinstance(member, Definition):
                return names.class_in(member.module, getattr(member.node, "returns", None))
            return names.class_in(owner.module, member.annotation) if owner and member else None
        if isinstance(node, ast.Call):
            called = self.called(node.func)
            if called is None:  # what copies or sorts a container leaves its items as they are
                return self.class_of(getattr(node.func, "value", None) or next(iter(node.args), None))
            made = isinstance(called.node, ast.ClassDef)
            return called if made else names.class_in(called.module, getattr(called.node, "returns", None))
        inner = getattr(node, "value", None) or getattr(node, "elt", None)
        parts = getattr(node, "values", None) or getattr(node, "elts", None) or [inner]
        kinds = (self.class_of(part) for part in parts if isinstance(part, ast.expr))
        return next((kind for kind in kinds if kind), None)
