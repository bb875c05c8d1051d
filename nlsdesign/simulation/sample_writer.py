"""One sample of a sampled system as a graph of calls.

A continuous plant and discrete blocks that are wired by name and sampled together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from ..foundation.errors import ValueRangeError, unknown_name
from ..model import FlatModel, Table
from ..model.transform import named

PLANT = "plant"


@dataclass(frozen=True, eq=False, kw_only=True)
class SampledSystem:
    """A continuous plant and discrete blocks, wired by name.

    Parameters
    ----------
    plant
        Continuous; its variables are called ``plant.NAME``.
    blocks
        Discrete models by name, sampled alike, in the order in which they are evaluated.
    sources
        For each input of a block, by full name, the full name of what it gets: a variable of the plant, an
        output of an earlier block, or its own name where it is an open input.
    driven
        Name of the plant's input that is driven by the first output of the last block, or ``None``.
    delay
        Samples between the computation of the driven input and its effect.
    substeps
        Runge–Kutta steps of the plant per sample. The product of the fastest eigenvalue and the step should
        stay below about 0.3.

    Raises
    ------
    ValueRangeError
        If the plant is discrete or has laws that jump, the blocks are not sampled alike, or delay or
        substeps is too small.
    """

    plant: FlatModel
    blocks: Mapping[str, FlatModel]
    sources: Mapping[str, str]
    driven: str | None
    delay: int = 1
    substeps: int = 10

    def __post_init__(self) -> None:
        if self.plant.sample_time is not None:
            raise ValueRangeError(f"model '{self.plant.name}'", "is discrete; the plant must be continuous")
        jumps = self.plant.switching.jumps if self.plant.switching is not None else ()
        if jumps:
            raise ValueRangeError(
                f"model '{self.plant.name}' with the sharp laws {', '.join(jumps)}",
                "cannot be the plant of a sampled loop, whose fixed steps locate no events",
                next_step="take the smooth form of the laws: flatten(smoothed(assembly))",
            )
        times = {block.sample_time for block in self.blocks.values()}
        if len(times) != 1 or None in times:
            raise ValueRangeError(f"sample times {times} s", "all blocks must be discrete and sampled alike")
        if self.delay < 0 or self.substeps < 1:
            raise ValueRangeError(f"delay {self.delay}, substeps {self.substeps}", "must be at least 0 and 1")

    @property
    def sample_time(self) -> float:
        """Sample time in s."""
        return float(next(iter(self.blocks.values())).sample_time or 0.0)

    @cached_property
    def owners(self) -> dict[str, FlatModel]:
        """Plant and blocks by name."""
        return {PLANT: self.plant, **self.blocks}

    @cached_property
    def open_inputs(self) -> tuple[str, ...]:
        """Full names of the inputs that are driven from outside, those of the plant first."""
        plant = [f"{PLANT}.{v.name}" for v in self.plant.inputs if v.name != self.driven]
        return (*plant, *(name for name, source in self.sources.items() if name == source))

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Full names of all states, and of the values of the driven input that wait for their sample."""
        names = [f"{owner}.{v.name}" for owner, model in self.owners.items() for v in model.states]
        waiting = self.delay if self.driven is not None else 0
        return (*names, *(f"{PLANT}.{self.driven}.waiting[{i + 1}]" for i in range(waiting)))

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Full names of all parameters."""
        return tuple(f"{owner}.{v.name}" for owner, model in self.owners.items() for v in model.parameters)


class SampleWriter:
    """Writes one sample as a graph of calls: read the plant, evaluate the blocks, integrate the plant."""

    def __init__(self, system: SampledSystem) -> None:
        self.system = system
        self.tables: dict[str, Table] = {}
        self.state = ca.MX.sym("state", len(system.states))
        self.parameter = ca.MX.sym("parameter", len(system.parameters))
        opened = system.open_inputs
        self.ramped = [name for name in opened if name.startswith(f"{PLANT}.")]
        self.given = ca.MX.sym("given", 1 + len(opened) + len(self.ramped))
        self.known: dict[str, ca.MX] = {name: self.given[1 + i] for i, name in enumerate(opened)}
        self.own_states = self._parts(self.state, "states")
        self.own_parameters = self._parts(self.parameter, "parameters")

    def function(self, keep: Sequence[str]) -> ca.Function:
        """Return one sample: (state, time and inputs, parameters) -> (state after, what is kept)."""
        system, count = self.system, len(self.system.states)
        first_waiting = sum(len(model.states) for model in system.owners.values())
        waiting = [self.state[i] for i in range(first_waiting, count)]
        acting = waiting[0] if waiting else None
        self._read_plant(acting, self._wanted(keep))
        following = self._blocks()
        if system.driven is not None:
            last = list(system.blocks)[-1]
            computed = self.known[f"{last}.{system.blocks[last].outputs[0].name}"]
            if acting is None:
                # What was computed just now acts at once: the blocks are given it before they move on.
                acting = self.known[f"{PLANT}.{system.driven}"] = computed
                following = self._blocks()
            else:
                waiting = [*waiting[1:], computed]
        after = [self._advance(acting), *following, *waiting]
        kept = [self._shown(name) for name in keep]
        return ca.Function(
            "sample",
            [self.state, self.given, self.parameter],
            [ca.densify(ca.vertcat(*after)), ca.densify(ca.vertcat(*kept))],
        )

    def begun(self, begins: Sequence[str]) -> ca.Function:
        """Return the states at the first sample: (state, time and inputs, parameters) -> (state)."""
        system = self.system
        first_waiting = sum(len(model.states) for model in system.owners.values())
        waiting = self.state[first_waiting:]
        self._read_plant(waiting[0] if waiting.numel() else None, self._wanted(()))
        states = [self.own_states[PLANT]]
        for owner, model in system.blocks.items():
            state = self.own_states[owner]
            if owner in begins and model.begin is not None:
                seen = self._seen(owner, state)
                state = model.begin(state, seen[0], self.own_parameters[owner], seen[1])[0]
            self._evaluate(owner, state)
            states.append(state)
        after = ca.densify(ca.vertcat(*states, waiting))
        return ca.Function("begun", [self.state, self.given, self.parameter], [after])

    def _parts(self, column: ca.MX, group: str) -> dict[str, ca.MX]:
        parts, first = {}, 0
        for owner, model in self.system.owners.items():
            last = first + len(getattr(model, group))
            parts[owner] = column[first:last]
            first = last
        return parts

    def _wanted(self, keep: Sequence[str]) -> list[str]:
        """Return the names of the plant's variables that are read or kept."""
        used = dict.fromkeys([*self.system.sources.values(), *keep])
        start = f"{PLANT}."
        own = [name.removeprefix(start) for name in used if name.startswith(start)]
        return [name for name in own if name != self.system.driven and f"{start}{name}" not in self.known]

    def _plant_inputs(self, acting: ca.MX | None) -> ca.MX:
        inputs = []
        for v in self.system.plant.inputs:
            if v.name == self.system.driven:
                inputs.append(ca.MX(v.start) if acting is None else acting)
            else:
                inputs.append(self.known[f"{PLANT}.{v.name}"])
        return ca.vertcat(*inputs) if inputs else ca.MX(0, 1)

    def _read_plant(self, acting: ca.MX | None, wanted: Sequence[str]) -> None:
        plant = self.system.plant
        s = plant.symbols()
        expressions = named(plant, s)
        for name in wanted:
            if name not in expressions:
                raise unknown_name("variable of the plant", name, expressions)
        if self.system.driven is not None and acting is not None:
            self.known[f"{PLANT}.{self.system.driven}"] = acting
        elif self.system.driven is not None:
            start = plant.variable(self.system.driven).start
            self.known[f"{PLANT}.{self.system.driven}"] = ca.MX(start)
        if not wanted:
            return
        read = ca.Function(
            "read",
            [s.time, s.state, s.input, s.parameter],
            [ca.densify(ca.vertcat(*[expressions[name] for name in wanted]))],
        )
        values = read(
            self.given[0], self.own_states[PLANT], self._plant_inputs(acting), self.own_parameters[PLANT]
        )
        self.known |= {f"{PLANT}.{name}": values[i] for i, name in enumerate(wanted)}

    def _blocks(self) -> list[ca.MX]:
        """Evaluate the blocks in their order; return their following states."""
        return [self._evaluate(owner, self.own_states[owner]) for owner in self.system.blocks]

    def _seen(self, owner: str, state: ca.MX) -> tuple[ca.MX, ca.MX]:
        """Return the inputs of a block and what it looks up."""
        model, inputs = self.system.blocks[owner], []
        for v in model.inputs:
            source = self.system.sources[f"{owner}.{v.name}"]
            if source not in self.known:
                raise unknown_name(f"source of '{owner}.{v.name}'", source, self.known)
            inputs.append(self.known[source])
        u = ca.vertcat(*inputs)
        columns = []
        for table in model.tables:
            name = f"look_up_{len(self.tables)}"
            self.tables[name] = table
            columns.append(looked_up(table, model, state, u, name=name))
        return u, ca.vertcat(*columns) if columns else ca.MX(0, 1)

    def _evaluate(self, owner: str, state: ca.MX) -> ca.MX:
        """Evaluate a block; return its following state."""
        model = self.system.blocks[owner]
        u, columns = self._seen(owner, state)
        s = model.symbols()
        step = ca.Function(
            "step",
            [s.state, s.input, s.parameter, s.table],
            [ca.densify(s.derivative), ca.densify(s.output)],
        )
        after, output = step(state, u, self.own_parameters[owner], columns)
        self.known |= {f"{owner}.{v.name}": u[i] for i, v in enumerate(model.inputs)}
        self.known |= {f"{owner}.{v.name}": output[i] for i, v in enumerate(model.outputs)}
        return after

    def _advance(self, acting: ca.MX | None) -> ca.MX:
        """Return the plant's state after one sample of classical Runge–Kutta steps."""
        system, plant = self.system, self.system.plant
        s, length = plant.symbols(), system.sample_time / system.substeps
        rate = ca.Function("rate", [s.time, s.state, s.input, s.parameter], [ca.densify(s.derivative)])
        step = _runge_kutta(rate, length)
        begin = self._plant_inputs(acting)
        ends = {name: self.given[-len(self.ramped) + i] for i, name in enumerate(self.ramped)}
        slope = ca.MX.zeros(len(plant.inputs), 1)
        for i, v in enumerate(plant.inputs):
            if f"{PLANT}.{v.name}" in ends:
                name = f"{PLANT}.{v.name}"
                slope[i] = (ends[name] - self.known[name]) / system.sample_time
        x = self.own_states[PLANT]
        for i in range(system.substeps):
            passed = i * length
            x = step(self.given[0] + passed, x, begin + slope * passed, slope, self.own_parameters[PLANT])
        return x

    def _shown(self, name: str) -> ca.MX:
        if name in self.known:
            return self.known[name]
        owner, _, own = name.partition(".")
        places = (
            {v.name: i for i, v in enumerate(self.system.owners[owner].states)}
            if owner in (self.system.owners)
            else {}
        )
        if own not in places:
            raise unknown_name("variable of the loop", name, [*self.known, *self.system.states])
        return self.own_states[owner][places[own]]


def looked_up(table: Table, model: FlatModel, state: ca.MX, u: ca.MX, *, name: str = "look_up") -> ca.MX:
    """Return the columns of a table at its argument: linear, held at the ends."""
    states = [v.name for v in model.states]
    if table.argument in states:
        at = state[states.index(table.argument)]
    else:
        at = u[[v.name for v in model.inputs].index(table.argument)]
    grid = table.grid
    mode = "exact" if table.breakpoints is None else "binary"
    look = ca.interpolant(name, "linear", [grid], table.values.ravel(), {"lookup_mode": [mode]})
    return look(ca.fmin(ca.fmax(at, grid[0]), grid[-1]))


def _runge_kutta(rate: ca.Function, step: float) -> ca.Function:
    """Return one classical Runge–Kutta step (t, x, u, slope of u, p) -> x, inputs linear within it."""
    t, x, u, p = (ca.SX.sym(n, rate.size1_in(i)) for i, n in enumerate(("t", "x", "u", "p")))
    slope = ca.SX.sym("slope", rate.size1_in(2))
    k1 = rate(t, x, u, p)
    k2 = rate(t + step / 2, x + step / 2 * k1, u + step / 2 * slope, p)
    k3 = rate(t + step / 2, x + step / 2 * k2, u + step / 2 * slope, p)
    k4 = rate(t + step, x + step * k3, u + step * slope, p)
    after = ca.densify(x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    return ca.Function("runge_kutta", [t, x, u, slope, p], [after])
