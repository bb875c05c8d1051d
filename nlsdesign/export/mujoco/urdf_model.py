"""Bodies of a flat model as a robot description in URDF: links, joints with their limits, transmissions.

URDF describes rigid bodies. Springs, friction and all other laws have no place in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

from ...foundation.errors import ExportError
from ...foundation.locations import version
from ...foundation.quantity import same_dimension
from ...foundation.text_files import write_text
from ...model.flat import FlatModel
from ...model.roles import declared_reading
from ...model.structure import MovingBody
from ..c.c_text import origin_lines
from .actuator_model import xml_comment

_BASE = "base"


def export_urdf(model: FlatModel, path: str | Path) -> Path:
    """Write the bodies of a plant as URDF: inertias, limits of its joints, a transmission for each motor.

    Range and largest speed of a joint are those that the deck declares of its encoder, the largest effort is
    that of the motor at its current limit. The inertia of a rotor stands in the link, reflected to the joint.

    Parameters
    ----------
    model
        Continuous, as ``flatten`` gives it, with a body that moves freely; also with sharp laws.
    path
        File to write.

    Returns
    -------
    Path
        That of the file.

    Raises
    ------
    ExportError
        If the model is sampled, has no body that moves freely, one whose motion is prescribed, or one that
        slides without a declared range, or if the file cannot be written.

    Examples
    --------
    >>> import tempfile, nlsdesign as nls
    >>> model = nls.flatten(nls.declare(nls.load_deck("austin2015_figure_consistent")))
    >>> with tempfile.TemporaryDirectory() as place:
    ...     print(nls.export.export_urdf(model, f"{place}/joint.urdf").read_text().count("<joint"))
    2
    """
    where = f"model '{model.name}'"
    if model.sample_time is not None:
        raise ExportError(where, "is sampled, and URDF describes a plant", next_step="export that of a deck")
    held = [body.name for body in model.bodies if body.prescribed]
    if held or not model.bodies:
        raise ExportError(
            f"{where}: '{held[0]}'" if held else where,
            "has a prescribed motion, and no inertia" if held else "has no body that moves freely",
            next_step="declare it as Inertia (rotation) or Mass (translation) in the deck",
        )
    head = [f"{model.name}: {model.description}", *origin_lines(model)]
    head.append(f"   All numbers in SI units. Written by nlsdesign {version()}; do not edit.")
    head.append(
        "   Springs, friction and other laws have no place in URDF; nlsdesign export mujoco carries them."
    )
    about = "\n".join(xml_comment(line) for line in head)
    lines = [
        f"<!-- {about} -->",
        f"<robot name={quoteattr(model.name)}>",
        f'  <link name="{_BASE}"/>',
        *(f"  {line}" for body in model.bodies for line in body_lines(model, body)),
        "</robot>",
    ]
    write_text(Path(path), "\n".join(lines) + "\n")
    return Path(path)


def body_lines(model: FlatModel, body: MovingBody) -> Iterator[str]:
    """Yield link, joint and transmission of one body."""
    numbers = model.values | model.evaluate(list(model.start(model.states)))
    inertia, turning = numbers[str(body.inertia)], same_dimension(body.domain.effort_unit, "N*m")
    name, limits = quoteattr(body.name), declared_reading(model, body.motion).limits
    motor, gear, effort = body.motor, 1.0, 0.0
    if motor is not None:
        gear = numbers[motor.gear_ratio] if motor.gear_ratio else 1.0
        effort = numbers[motor.current_limit] * numbers[motor.torque_constant] * gear
    if limits is None and not turning:
        raise ExportError(
            f"model '{model.name}': '{body.name}'", "slides, and URDF wants the range of such a joint",
            next_step="declare lowest_reading, highest_reading, largest_rate and stale_time with its encoder",
        )  # fmt: skip
    kind = "prismatic" if not turning else "revolute" if limits else "continuous"
    yield f"<link name={name}>"
    # The centre of mass lies on the axis, so the mass of what turns has no effect.
    yield f'  <inertial><origin xyz="0 0 0"/><mass value="{inertia!r}"/>'
    around = f'ixx="{inertia!r}" iyy="{inertia!r}" izz="{inertia!r}"'
    yield f'    <inertia {around} ixy="0" ixz="0" iyz="0"/></inertial>'
    yield "</link>"
    yield f'<joint name={name} type="{kind}">'
    yield f'  <parent link="{_BASE}"/><child link={name}/><axis xyz="{"0 0 1" if turning else "1 0 0"}"/>'
    if limits:
        lowest, highest, rate, _ = limits
        yield f'  <limit lower="{lowest!r}" upper="{highest!r}" effort="{effort!r}" velocity="{rate!r}"/>'
    yield "</joint>"
    if motor is not None and motor.command:
        interface = "<hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>"
        yield f"<transmission name={quoteattr(f'{body.name}.transmission')}>"
        yield "  <type>transmission_interface/SimpleTransmission</type>"
        yield f"  <joint name={name}>{interface}</joint>"
        yield f"  <actuator name={quoteattr(motor.command)}>{interface}"
        yield f"    <mechanicalReduction>{gear!r}</mechanicalReduction></actuator>"
        yield "</transmission>"
