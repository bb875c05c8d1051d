"""A continuous flat model as a model of MuJoCo: MJCF, and the laws that MuJoCo lacks as C.

Bodies become joints, inner states become activations, and MuJoCo integrates both. Inertias and drives are
MuJoCo's own elements. All other efforts come from the equations of the flat model: each law is the deck's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import casadi as ca

from ...foundation.errors import ExportError
from ...foundation.locations import version
from ...foundation.quantity import same_dimension
from ...model.flat import FlatModel, Variable
from ..c.c_text import (
    Real,
    cells,
    comment,
    identifier,
    number_lines,
    origin_lines,
    origin_macros,
    stamped,
    string,
)
from ..c.instructions import print_statements
from ..files import check_continuous, filled, write_all

HOLDER = "inner_states"
"""Name of the actuator whose activations are the inner states; it drives nothing."""
STEP = 1.0e-3
"""Time step that is written, s: the sample time of the torque loop. A robot's MJCF has its own."""
_BODY_SHARE = 1.0e-6
"""Of a motor's inertia in the body, which MuJoCo wants positive; the rest is armature."""


class _Drive(NamedTuple):
    """An input as an actuator: the joint it acts on, and what MuJoCo does itself with it."""

    input: Variable
    joint: str
    gear: float
    gain: float
    limit: float | None


@dataclass(frozen=True)
class MujocoModel:
    """Files of an actuator: MJCF without and with the plug-in, C, Python module, build file, README."""

    name: str
    model: FlatModel
    scene: Path
    plugin_scene: Path
    sources: tuple[Path, Path, Path]
    module: Path
    others: tuple[Path, Path]

    @property
    def files(self) -> tuple[Path, ...]:
        """All files."""
        return (self.scene, self.plugin_scene, *self.sources, self.module, *self.others)


def export_mujoco(model: FlatModel, folder: str | Path) -> MujocoModel:
    """Write a plant as MJCF, with an engine plug-in in C and a Python module that carry its laws.

    Parameters
    ----------
    model
        Continuous and smooth, as ``flatten`` gives it, with a body that moves freely.
    folder
        For all files; created where it is missing.

    Raises
    ------
    ExportError
        If the model is sampled, has tables or sharp laws, no body that moves freely or one whose motion is
        prescribed, or if a file cannot be written. Nothing is written then.

    Examples
    --------
    >>> import tempfile, nlsdesign as nls
    >>> model = nls.flatten(nls.declare(nls.load_deck("dfki_pendulum")))
    >>> with tempfile.TemporaryDirectory() as place:
    ...     print([file.name for file in nls.export.export_mujoco(model, place).files][:2])
    ['dfki_pendulum.xml', 'dfki_pendulum_plugin.xml']
    """
    where = f"model '{model.name}'"
    check_continuous(
        model, sampled="is sampled, and MuJoCo integrates a continuous plant",
        step="export the sampled part as C (nlsdesign export c) and call its step between mj_step",
        sharp="is sharp, and MuJoCo, which locates no events, cannot carry it",
    )  # fmt: skip
    held = [body for body in model.bodies if body.prescribed]
    if held:
        raise ExportError(
            f"{where}: '{held[0].name}'", "has a prescribed motion, and a joint of MuJoCo moves by forces",
            next_step="declare it as Inertia (rotation) or Mass (translation) in the deck",
        )  # fmt: skip
    if not model.bodies:
        raise ExportError(where, "has no body that moves freely", next_step="declare one in the deck")
    writer = _Writer(model)
    stems = [f"{writer.name}{each}" for each in (".xml", "_plugin.xml", ".h", ".c", "_plugin.c", ".py")]
    paths = [Path(folder) / name for name in (*stems, "CMakeLists.txt", "README.md")]
    templates = ("law.h", "law.c", "plugin.c", "try.txt", "CMakeLists.txt", "readme.md")
    generated = [filled(f"mujoco_{each}", writer.values) for each in templates]
    texts = (writer.scene(), writer.plugin_scene(), *generated)
    write_all(
        {
            path: stamped(text, model) if path.suffix in (".c", ".h") else text
            for path, text in zip(paths, texts, strict=True)
        }
    )
    return MujocoModel(
        writer.name, model, paths[0], paths[1], (paths[2], paths[3], paths[4]), paths[5], (paths[6], paths[7])
    )


@dataclass(frozen=True, eq=False)
class _Writer:
    """Texts of all files of one model."""

    model: FlatModel

    @cached_property
    def name(self) -> str:
        """Prefix of files and C names."""
        return identifier(self.model.name)

    @cached_property
    def inner(self) -> list[Variable]:
        """States that are neither motion nor rate of a body."""
        of_bodies = {name for body in self.model.bodies for name in (body.motion, body.rate)}
        return [v for v in self.model.states if v.name not in of_bodies]

    @cached_property
    def numbers(self) -> dict[str, float]:
        """Parameters, and signals at the start."""
        model = self.model
        return model.values | model.evaluate(list(model.start(model.states)))

    @cached_property
    def drives(self) -> list[_Drive]:
        """One for each input."""
        drives = []
        for v in self.model.inputs:
            body = next((b for b in self.model.bodies if v.name in b.drives), self.model.bodies[0])
            motor, known = body.motor, self.numbers
            if motor is not None and v.name == motor.command and same_dimension(v.unit, "A"):
                gear = known[motor.gear_ratio] if motor.gear_ratio else 1.0
                gain, limit = known[motor.torque_constant], known[motor.current_limit]
                drives.append(_Drive(v, body.name, gear, gain, limit))
            else:
                # A voltage or a goal makes an effort by a law, which the plug-in carries.
                direct = v.name in body.drives and same_dimension(v.unit, body.domain.effort_unit)
                drives.append(_Drive(v, body.name, 1.0, 1.0 if direct else 0.0, None))
        return drives

    def scene(self) -> str:
        """Return the MJCF."""
        model, states = self.model, {v.name: v.start for v in self.model.states}
        actuators = [
            f"<general name={quoteattr(d.input.name)} joint={quoteattr(d.joint)} "
            f'gear="{d.gear!r}" gainprm="{d.gain!r}"'
            + ("/>" if d.limit is None else f' ctrlrange="{-d.limit!r} {d.limit!r}"/>')
            for d in self.drives
        ]
        if self.inner:
            about = ", ".join(v.name for v in self.inner)
            actuators += [
                f"<!-- Activations: {xml_comment(about)}. -->",
                f'<general name="{HOLDER}" joint={quoteattr(model.bodies[0].name)} dyntype="user" '
                f'actdim="{len(self.inner)}" gainprm="0"/>',
            ]
        bodies = list[str]()
        for body in model.bodies:
            inertia, turning = self.numbers[str(body.inertia)], same_dimension(body.domain.effort_unit, "N*m")
            kind, axis = ("hinge", "0 0 1") if turning else ("slide", "1 0 0")
            own = inertia * _BODY_SHARE if body.motor and turning else inertia
            armature = f' armature="{inertia - own!r}"' if own != inertia else ""
            bodies += [
                f"<body name={quoteattr(body.name)}>",
                f'  <joint name={quoteattr(body.name)} type="{kind}" axis="{axis}"{armature}/>',
                # The centre of mass lies on the axis, so the mass of what turns has no effect.
                f'  <inertial pos="0 0 0" mass="{own!r}" diaginertia="{own!r} {own!r} {own!r}"/>',
                "</body>",
            ]
        start = {
            "qpos": [states[b.motion] for b in model.bodies],
            "qvel": [states[b.rate] for b in model.bodies],
            "act": [v.start for v in self.inner],
        }
        key = " ".join(f'{name}="{" ".join(map(repr, row))}"' for name, row in start.items() if row)
        lines = [
            f"<mujoco model={quoteattr(model.name)}>",
            '  <compiler angle="radian" autolimits="true"/>',
            f'  <option timestep="{STEP}" integrator="RK4"/>',
            "  <worldbody>",
            *(f"    {line}" for line in bodies),
            "  </worldbody>",
            "  <actuator>",
            *(f"    {line}" for line in actuators),
            "  </actuator>",
            f'  <keyframe><key name="start" {key}/></keyframe>',
            "</mujoco>",
        ]
        return self._xml(lines)

    def plugin_scene(self) -> str:
        """Return the MJCF that takes the other one and adds the plug-in."""
        return self._xml(
            [
                f"<mujoco model={quoteattr(self.model.name)}>",
                "  <extension>",
                f'    <plugin plugin="nlsdesign.{self.name}"><instance name="{self.name}"/></plugin>',
                "  </extension>",
                f'  <include file="{self.name}.xml"/>',
                "</mujoco>",
            ]
        )

    def _xml(self, lines: Sequence[str]) -> str:
        head = [f"{self.model.name}: {self.model.description}", *origin_lines(self.model)]
        head.append(f"   All numbers in SI units. Written by nlsdesign {version()}; do not edit.")
        about = "\n".join(xml_comment(line) for line in head)
        return "\n".join([f"<!-- {about} -->", *lines]) + "\n"

    @cached_property
    def values(self) -> dict[str, str | list[str]]:
        """What fills the templates."""
        model, joints = self.model, [b.name for b in self.model.bodies]
        inputs, inner = [v.name for v in model.inputs], [v.name for v in self.inner]
        parameters, outputs = [v.name for v in model.parameters], [v.name for v in model.outputs]
        names = {"joint": joints, "input": inputs, "inner_state": inner, "output": outputs}
        single = {
            "title": _plain(f"{model.name}: {model.description}"), "version": version(), "name": self.name,
            "guard": self.name.upper(), "holder": HOLDER, "states": str(len(model.states)),
            "bodies": str(len(joints)), "inputs": str(len(inputs)), "inner": str(len(inner)),
            "outputs": str(len(outputs)), "parameters": str(len(parameters)),
            "finds": ", ".join(f"`{name}`" for name in (*joints, *inputs, *([HOLDER] if inner else []))),
        }  # fmt: skip
        return single | {f"{kind}_tuple": "".join(f"{n!r}, " for n in row) for kind, row in names.items()} | {
            "origin": [_plain(line) for line in origin_lines(model)],
            "macros": origin_macros(model, self.name),
            "values": [f"{Real.DOUBLE.literal(v.start)}, /* {comment(v.name)} */" for v in model.parameters],
            "statements": self.statements,
            "numbers": number_lines(model),
            "attributes": [f"{string(name)}," for name in parameters],
            "joint_rows": [f"{string(name)}," for name in joints],
            "actuator_rows": [f"{string(name)}," for name in inputs],
            "parameter_rows": [f"{name!r}," for name in parameters],
            "carried": self.carried,
        }  # fmt: skip

    @cached_property
    def carried(self) -> list[str]:
        """What MuJoCo does itself and what the equations of the deck do, as rows of a list."""
        native = [d for d in self.drives if d.gain]
        by_law = [d.input.name for d in self.drives if not d.gain]
        rows = ["- MuJoCo itself: inertias" + "".join(f", the effort of `{d.input.name}`" for d in native)]
        rows.append(
            "- Plug-in or callback: every other effort of the deck (springs, cams, dashpots, friction, "
            "backlash, stops)" + "".join(f", the effort of `{name}`" for name in by_law)
        )
        if self.inner:
            states = ", ".join(f"`{v.name}`" for v in self.inner)
            rows.append(f"- Inner states, integrated by MuJoCo as activations of `{HOLDER}`: {states}")
        return [*rows, ""]

    @cached_property
    def statements(self) -> list[str]:
        """The body of the C function that gives efforts, rates of inner states, and outputs."""
        model, s = self.model, self.model.symbols()
        place = {v.name: i for i, v in enumerate(model.states)}
        signal = {v.name: s.signal[i] for i, v in enumerate(model.signals)}
        signal |= {v.name: s.parameter[i] for i, v in enumerate(model.parameters)}
        efforts = [s.derivative[place[b.rate]] * signal[str(b.inertia)] for b in model.bodies]
        rates = [s.derivative[place[v.name]] for v in self.inner]
        results = [ca.SX(ca.vertcat(*efforts)), ca.SX(ca.vertcat(*rates)), s.output]
        function = ca.Function(
            "laws", [s.time, s.state, s.input, s.parameter], [ca.densify(e) for e in results], {"cse": True}
        )
        order = [name for b in model.bodies for name in (b.motion, b.rate)] + [v.name for v in self.inner]
        texts = [
            ["t"], [f"x[{order.index(v.name)}]" for v in model.states],
            *(cells(letter, len(group)) for letter, group in (("u", model.inputs), ("p", model.parameters))),
        ]  # fmt: skip
        targets = [cells("effort", len(efforts)), cells("rate", len(rates)), cells("y", s.output.numel())]
        return print_statements(function, texts, targets, real=Real.DOUBLE)


def xml_comment(text: str) -> str:
    """Return text that cannot end a comment of XML, which allows no two hyphens."""
    return text.replace("--", "- -").rstrip("-")


def _plain(text: str) -> str:
    """Return text that fits into a comment of C, a text of Python and a page."""
    return comment(text).replace("\\", "/").replace('"', "'")
