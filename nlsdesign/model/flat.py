"""A frozen, flat, named model of ordinary differential (or difference) equations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import casadi as ca
import numpy as np

from ..foundation.arrays import Array
from ..foundation.errors import ExportError, UnitError, ValueRangeError, unknown_name
from ..foundation.quantity import Quantity, changed_source, same_dimension, typeset_unit, with_unit
from ..foundation.spread import EXACT, Spread, as_spread
from ..foundation.symbolic import Expression
from .origin import Origin
from .readings import ReadingNames
from .structure import MovingBody, SpringNames

if TYPE_CHECKING:
    from .symbolic_view import Equations


@dataclass(frozen=True)
class Plausibility:
    """How fast a measured input can change, and how long it can stay the same.

    The range in which a reading can lie is ``minimum`` to ``maximum`` of its variable. An input without
    plausibility is a command: outside its range it is taken at the limit.

    Parameters
    ----------
    largest_rate
        Largest rate of the measured quantity, in its unit per second.
    resolution
        Change from sample to sample that is always possible, such as two counts, in the unit.
    stale_time
        Time in s after which a reading that has not changed at all counts as stale, if meanwhile what moves
        the machine has changed.
    moved_by
        Name of the input or state that moves the machine, for instance the current of its motor; ``None``
        where that is not known: then a reading is stale after the time in any case.
    noticeable
        Change of ``moved_by`` that a working sensor cannot fail to show.

    Raises
    ------
    ValueRangeError
        If a number is not positive; only the resolution may be zero.
    """

    largest_rate: float = math.inf
    resolution: float = 0.0
    stale_time: float = math.inf
    moved_by: str | None = None
    noticeable: float = 0.0

    def __post_init__(self) -> None:
        small = 0.0 <= self.resolution < math.inf and 0.0 <= self.noticeable < math.inf
        if not (self.largest_rate > 0.0 and self.stale_time > 0.0 and small):
            rule = "needs a positive rate and time; resolution and noticeable change must not be negative"
            raise ValueRangeError(f"{self}", rule)


@dataclass(frozen=True)
class Variable:
    """A named number of the model: state, input, parameter, output or signal. All in SI.

    Parameters
    ----------
    name
        Hierarchical name, the same in deck, C struct, FMU, CSV and plot.
    unit
        SI unit as text.
    description
        What it is, in words.
    start
        Start value of a state or input; value of a parameter.
    nominal
        Typical size, for scaling.
    minimum, maximum
        Range in which the laws are stated to hold.
    source, spread
        Where a parameter's number comes from, and how far the true one may lie from it.
    plausibility
        Of a measured input: what a reading can be. Of an output: ``noticeable``, above which it sets a flag.
    largest_rate
        Of a command: how fast it is followed at most, in its unit per second.
    """

    name: str
    unit: str
    description: str
    start: float = 0.0
    nominal: float = 1.0
    minimum: float = -float("inf")
    maximum: float = float("inf")
    source: str = ""
    spread: Spread = EXACT
    plausibility: Plausibility | None = None
    largest_rate: float = float("inf")

    def __post_init__(self) -> None:
        object.__setattr__(self, "spread", as_spread(self.spread))

    @property
    def uncertain(self) -> bool:
        """Whether the number may differ from the declared one: a relative spread leaves a zero as it is."""
        return self.spread.standard_error(self.start) > 0.0

    @property
    def spread_text(self) -> str:
        """The spread as people read it, in SI where it is not relative; nothing for an exact number."""
        return self.spread.text(lambda v: with_unit(f"{v:.6g}", self.unit))

    @property
    def bounded(self) -> bool:
        """Whether a range is stated."""
        return math.isfinite(self.minimum) or math.isfinite(self.maximum)


@dataclass(frozen=True, eq=False)
class Table:
    """Numbers over a grid of one argument, read by linear interpolation and held at the ends.

    Parameters
    ----------
    argument
        Name of the input or state that is looked up.
    lower, step
        First grid point and distance of the grid points; the step is zero where breakpoints are given.
    columns
        The quantities that are looked up.
    values
        Array of shape (grid points, columns).
    breakpoints
        Grid points of a grid that is not uniform, ascending, shape (grid points,); see :meth:`over`.

    Raises
    ------
    ValueRangeError
        If breakpoints are not finite, ascending and one per row, beginning at ``lower``.
    """

    argument: str
    lower: float
    step: float
    columns: tuple[Variable, ...]
    values: Array
    breakpoints: Array | None = None

    def __post_init__(self) -> None:
        if self.breakpoints is None:
            return
        points = np.asarray(self.breakpoints, dtype=np.float64)
        fits = points.shape == (self.values.shape[0],) and points.size > 1 and points[0] == self.lower
        if not (fits and self.step == 0.0 and np.all(np.isfinite(points)) and np.all(np.diff(points) > 0.0)):
            raise ValueRangeError(
                f"table over '{self.argument}'",
                "needs finite, ascending breakpoints, one for each row of values and at least two",
                next_step="build it with Table.over(argument, breakpoints, columns, values)",
            )

    @staticmethod
    def over(argument: str, points: Array, columns: tuple[Variable, ...], values: Array) -> Table:
        """Return a table over breakpoints, which need not be uniform.

        Parameters
        ----------
        argument
            Name of the input or state that is looked up.
        points
            Breakpoints, ascending, shape (n,).
        columns
            The quantities that are looked up.
        values
            Shape (n, columns).

        Raises
        ------
        ValueRangeError
            If the breakpoints are not finite, ascending and one per row.
        """
        return Table(argument, float(points[0]) if len(points) else 0.0, 0.0, columns, values, points)

    @property
    def grid(self) -> Array:
        """All grid points, shape (grid points,)."""
        if self.breakpoints is not None:
            return self.breakpoints
        return np.asarray(self.lower + self.step * np.arange(self.values.shape[0]), dtype=np.float64)

    @property
    def ends(self) -> tuple[float, float]:
        """First and last grid point."""
        last = self.lower + self.step * (self.values.shape[0] - 1)
        return self.lower, last if self.breakpoints is None else float(self.breakpoints[-1])

    def look_up(self, at: float) -> Array:
        """Return all columns at one argument; not a number where the argument is none.

        Parameters
        ----------
        at
            Value of the argument.

        Returns
        -------
        numpy.ndarray
            Shape (columns,).
        """
        if math.isnan(at):
            return np.full(self.values.shape[1], np.nan)
        last = self.values.shape[0] - 1
        if (points := self.breakpoints) is not None:
            held = min(max(at, float(points[0])), float(points[last]))
            left = min(int(np.searchsorted(points, held, side="right")) - 1, last - 1)
            share = float((held - points[left]) / (points[left + 1] - points[left]))
            return np.asarray(self.values[left] + share * (self.values[left + 1] - self.values[left]))
        position = min(max((at - self.lower) / self.step, 0.0), float(last))
        left = min(int(position), last - 1)
        share = position - left
        result: Array = self.values[left] + share * (self.values[left + 1] - self.values[left])
        return result


class Symbols(NamedTuple):
    """Symbols and expressions of a flat model, columns of SX.

    ``derivative`` is the next state where the model has a sample time. ``table`` holds the looked-up
    columns of all tables in order.
    """

    time: Expression
    state: Expression
    input: Expression
    parameter: Expression
    table: Expression
    derivative: Expression
    output: Expression
    signal: Expression
    residual: Expression


INTERFACE = (["time", "state", "input", "parameter", "table"], ["derivative", "output", "signal", "residual"])
"""Names of the arguments and of the results of the equations of a flat model."""
_NONE = ca.SX(0, 1)


def stated_equations(
    state: Expression,
    given: Expression,
    *,
    derivative: Expression,
    output: Expression,
    parameter: Expression = _NONE,
    table: Expression = _NONE,
    signal: Expression = _NONE,
) -> ca.Function:
    """Return equations of a flat model in which neither time nor a residual stands; ``given``: its inputs."""
    arguments = [ca.SX.sym("time"), state, given, parameter, table]
    return ca.Function("equations", arguments, [derivative, output, signal, _NONE], *INTERFACE)


@dataclass(frozen=True)
class Switch:
    """A place at which the equations of a model are not smooth."""

    name: str  # full name of the element or sensor
    # words: what has happened when a mode begins: pairs of mode (−1, 0, 1) and text; a rebound is at 2
    words: tuple[tuple[int, str], ...]
    # jumps: whether the derivatives jump or a rate is held there, so that the equations can only be
    # integrated by a method that locates it. A mere corner costs other methods accuracy, but they get across.
    jumps: bool


@dataclass(frozen=True, eq=False)
class Switching:
    """The switches of a model and its equations while their modes do not change."""

    switches: tuple[Switch, ...]  # k of them
    # branch: casadi.Function (t, x, u, p, m) -> (f, c, v): derivative with all modes held at m, for each
    # switch a number that is not negative as long as its mode lasts, and the rate that it may hold
    branch: ca.Function
    # natural: (t, x, u, p) -> m: the modes at a state; the equations of the flat model are those of these
    # modes
    natural: ca.Function
    # landing: (t, x, u, p, m) -> (v, target, leads, reach, slope) for the switches that hold a rate: the
    # rate, shape (k,), what it is after landing, the mode that follows when it is let go, the change of all
    # derivatives per effort, shape (states, k), and ∂v/∂x, shape (k, states). Zero for the others.
    landing: ca.Function
    holds: tuple[bool, ...]  # for each switch whether it holds a rate
    shown: ca.Function  # (t, x, u, p, m) -> (y, s): outputs and signals with all modes held at m

    @property
    def jumps(self) -> tuple[str, ...]:
        """Names of the switches that only a method which locates them can integrate."""
        return tuple(s.name for s in self.switches if s.jumps)


@dataclass(frozen=True, eq=False)
class FlatModel:
    """Equations dx/dt = f(t, x, u, p), y = g(t, x, u, p) with the names of everything in them.

    Parameters
    ----------
    name, description
        Name of the model and one sentence.
    states, inputs, parameters, outputs, signals
        Names, units and numbers, in the order of the vectors. Outputs are the interface; signals are
        everything else that has a name.
    equations
        ``casadi.Function`` (t, x, u, p, w) -> (f, y, s, r): derivative or next state, outputs, signals,
        and residuals of implicit equations, which vanish where these were solved.
    sample_time
        ``None`` for continuous time; otherwise f is the state one sample later.
    tables
        Looked-up numbers w; empty for a continuous model.
    switching
        Where the equations are not smooth; ``None`` if they are everywhere, or where it is not declared.
    bodies, springs, readings
        What the model is made of: which variables belong together, in written order. Empty where that is
        not declared.
    begin
        Of a sampled model: ``casadi.Function`` (x, u, p, w) -> (begun, resumed): from the start values the
        states of a machine that rests at its first reading, and from the last states those with which it
        goes on after a gap in its readings. ``None`` where the states fit any reading.
    expected
        Of a sampled model: ``casadi.Function`` (x, u, p, w) -> what it expects of each input, which takes the
        place of a reading that cannot be used; ``None`` where it expects nothing.
    origin
        The deck behind the model, ``None`` where it was made otherwise.
    """

    name: str
    description: str
    states: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    parameters: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    signals: tuple[Variable, ...]
    equations: ca.Function
    sample_time: float | None = None
    tables: tuple[Table, ...] = ()
    switching: Switching | None = None
    bodies: tuple[MovingBody, ...] = ()
    springs: tuple[SpringNames, ...] = ()
    readings: tuple[ReadingNames, ...] = ()
    begin: ca.Function | None = None
    expected: ca.Function | None = None
    origin: Origin | None = None

    def symbols(self) -> Symbols:
        """Return fresh symbols and the expressions in them."""
        t, w = ca.SX.sym("time"), ca.SX.sym("w", self.equations.size1_in(4))
        x = ca.vertcat(*[ca.SX.sym(v.name) for v in self.states])
        u = ca.vertcat(*[ca.SX.sym(v.name) for v in self.inputs])
        p = ca.vertcat(*[ca.SX.sym(v.name) for v in self.parameters])
        return Symbols(t, ca.SX(x), ca.SX(u), ca.SX(p), w, *self.equations.call([t, x, u, p, w]))

    @property
    def values(self) -> dict[str, float]:
        """Parameter values in SI by name."""
        return {v.name: v.start for v in self.parameters}

    def start(self, of: Sequence[Variable]) -> Array:
        """Return the start values of a group of variables as a vector.

        Parameters
        ----------
        of
            For instance ``model.states``.
        """
        return np.array([v.start for v in of], dtype=float)

    def variable(self, name: str) -> Variable:
        """Return the variable of that name.

        Parameters
        ----------
        name
            Name of any state, input, parameter, output or signal.

        Raises
        ------
        UnknownNameError
            With the nearest name that exists.
        """
        everything = self.states + self.inputs + self.parameters + self.outputs + self.signals
        for each in everything:
            if each.name == name:
                return each
        raise unknown_name("variable", name, (v.name for v in everything))

    def with_values(self, values: Mapping[str, float | Quantity]) -> FlatModel:
        """Return a copy with other parameter values, or start values of states and inputs.

        Parameters
        ----------
        values
            Numbers in SI, or quantities, by name.

        Raises
        ------
        UnknownNameError
            If a name is neither parameter, state nor input.
        ValueRangeError
            If a number is outside the stated range.
        UnitError
            If a quantity measures something else.
        """
        names = {v.name for group in (self.parameters, self.states, self.inputs) for v in group}
        for name in values:
            if name not in names:
                raise unknown_name("parameter, state or input", name, names)

        def changed(group: tuple[Variable, ...]) -> tuple[Variable, ...]:
            return tuple(_with_start(v, values[v.name]) if v.name in values else v for v in group)

        numbers = {v.name: values[v.name] for v in self.parameters if v.name in values}
        return replace(
            self,
            origin=self.origin and self.origin.with_values(numbers),
            parameters=changed(self.parameters),
            states=changed(self.states),
            inputs=changed(self.inputs),
        )

    def evaluate(
        self, state: Sequence[float], inputs: Sequence[float] = (), *, time: float = 0.0
    ) -> dict[str, float]:
        """Return every output, signal and state derivative at one point; ``der(name)`` for the latter.

        Parameters
        ----------
        state
            Shape (states,).
        inputs
            Shape (inputs,); the start values if it is left out.
        time
            Time in s.
        """
        u = list(inputs) if len(inputs) else [v.start for v in self.inputs]
        f, y, s, _ = self.equations(time, state, u, self.start(self.parameters), self.look_up(state, u))
        rate = "der({})" if self.sample_time is None else "next({})"
        result = {rate.format(v.name): float(f[i]) for i, v in enumerate(self.states)}
        result |= {v.name: float(s[i]) for i, v in enumerate(self.signals)}
        return result | {v.name: float(y[i]) for i, v in enumerate(self.outputs)}

    def look_up(self, state: Sequence[float], inputs: Sequence[float]) -> Array:
        """Return the columns of all tables at one state and input.

        Parameters
        ----------
        state, inputs
            Shapes (states,) and (inputs,).
        """
        at = {v.name: float(state[i]) for i, v in enumerate(self.states)}
        at |= {v.name: float(inputs[i]) for i, v in enumerate(self.inputs)}
        columns = [table.look_up(at[table.argument]) for table in self.tables]
        return np.concatenate(columns) if columns else np.zeros(0)

    def symbolic_equations(self, *, longest: float = 60) -> Equations:
        """Return the equations as SymPy expressions, which print, and give LaTeX by ``latex()``.

        ``equations`` is the casadi.Function that everything is computed with; this is the view for people,
        and for SymPy where ``longest`` is raised.

        Parameters
        ----------
        longest
            Operations beyond which a definition is shown as a function of what it depends on; ``math.inf``
            gives every definition in full, which takes SymPy minutes where a law is long.

        Returns
        -------
        Equations
            Derivatives by state, and definitions of signals and outputs in the order of computation.

        Raises
        ------
        ExportError
            If a law uses an operation that has no SymPy counterpart here.

        Examples
        --------
        >>> from nlsdesign.components import ROTATION, Inertia, Spring, assembly, tie
        >>> from nlsdesign.model import flatten
        >>> spring = tie(Spring(stiffness=2.0, domain=ROTATION), "wheel")
        >>> swing = flatten(assembly("swing", wheel=Inertia(inertia=1e-3), spring=spring))
        >>> swing.symbolic_equations().derivatives["wheel.angle"]
        wheel.speed
        """
        from .symbolic_view import read_equations  # here, because SymPy takes most of a second to load

        columns = [v for table in self.tables for v in table.columns]
        groups = (self.states, self.inputs, self.parameters, columns)
        inputs = [["time"], *([v.name for v in group] for group in groups)]
        results = [[v.name for v in group] for group in (self.states, self.outputs, self.signals)]
        return read_equations(
            self.equations, inputs, results, discrete=self.sample_time is not None, longest=longest
        )

    def _repr_html_(self) -> str:
        """Return the model as a block with its signals, and its equations, for notebooks."""
        from .symbolic_view import model_html

        groups = [
            [f"{v.name} [{typeset_unit(v.unit) or '1'}]" for v in group]
            for group in (self.inputs, self.states, self.outputs)
        ]
        return model_html(self.name, self.description, groups, self._latex())

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        """Return text, equations and picture; a notebook takes the richest that it can show."""
        latex = self._latex()
        equations = {"text/latex": f"$${latex}$$"} if latex else {}
        return {"text/plain": str(self), **equations, "text/html": self._repr_html_()}

    def _latex(self) -> str:
        try:
            return self.symbolic_equations().latex()
        except ExportError:
            return ""  # a law without a SymPy counterpart: the notebook shows the rest

    def __str__(self) -> str:
        kind = "continuous" if self.sample_time is None else f"every {self.sample_time:g} s"
        lines = [f"FlatModel {self.name} ({kind}): {self.description}"]
        for title in ("states", "inputs", "outputs", "parameters"):
            group: tuple[Variable, ...] = getattr(self, title)
            lines.append(f"  {title} ({len(group)})")
            lines += [f"    {v.name} = {with_unit(f'{v.start:.6g}', v.unit)}  {v.description}" for v in group]
        return "\n".join(lines)


def _with_start(variable: Variable, given: float | Quantity) -> Variable:
    value = given.number if isinstance(given, Quantity) else float(given)
    if isinstance(given, Quantity) and not same_dimension(given.unit, variable.unit):
        raise UnitError(
            f"{variable.name} = {given}",
            f"'{given.unit}' does not measure {variable.description}",
            next_step=f"give it in a unit like '{variable.unit}'",
        )
    if not variable.minimum <= value <= variable.maximum:
        raise ValueRangeError(
            f"{variable.name} = {with_unit(f'{value:g}', variable.unit)}",
            "must lie in " + with_unit(f"[{variable.minimum:g}, {variable.maximum:g}]", variable.unit),
        )
    if isinstance(given, Quantity):
        return replace(variable, start=value, source=given.source, spread=given.spread)
    source = variable.source
    if source and value != variable.start:
        source = changed_source(with_unit(f"{variable.start:.6g}", variable.unit), source)
    return replace(variable, start=value, source=source)


def casadi_dae(model: FlatModel) -> dict[str, ca.SX]:
    """Return a continuous model as the mapping that ``casadi.integrator`` takes.

    Parameters
    ----------
    model
        Continuous, without tables.

    Returns
    -------
    dict
        SX columns: ``t``, ``x``, ``u``, ``p``, ``ode``, and ``y`` with the outputs, in the order of
        ``model.states``, ``inputs``, ``parameters`` and ``outputs``. Take ``y`` out for an integrator.

    Raises
    ------
    ValueRangeError
        If the model is sampled or has tables.

    Examples
    --------
    >>> import casadi, nlsdesign as nls
    >>> model = nls.flatten(nls.declare(nls.load_deck("dfki_pendulum")))
    >>> dae = nls.model.casadi_dae(model)
    >>> outputs = dae.pop("y")
    >>> run = casadi.integrator("run", "cvodes", dae, 0.0, 0.1)
    >>> end = run(x0=model.start(model.states), u=[0.5], p=model.start(model.parameters))["xf"]
    >>> end.shape
    (2, 1)
    """
    if model.sample_time is not None or model.tables:
        raise ValueRangeError(
            f"model '{model.name}'",
            "is sampled, an integrator takes a continuous one",
            next_step="call model.equations, which gives the states one sample later",
        )
    s = model.symbols()
    return {"t": s.time, "x": s.state, "u": s.input, "p": s.parameter, "ode": s.derivative, "y": s.output}


def equations(model: FlatModel) -> Equations:
    """Return the equations of a flat model as SymPy expressions; the same as ``model.symbolic_equations()``.

    Parameters
    ----------
    model
        Continuous or discrete.

    Raises
    ------
    ExportError
        If a law uses an operation that has no SymPy counterpart here.
    """
    return model.symbolic_equations()
