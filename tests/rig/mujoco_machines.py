"""The plants of `kinds` as MuJoCo advances them: a simulator that nobody here wrote.

Friction is the `frictionloss` of a joint, the inertia of the motor its `armature`, a spring between two
bodies a tendon with stiffness and damping, backlash a joint of its own that moves freely within its limits,
which are soft contacts. What depends on time or goes round with the angle is an applied torque. MuJoCo's
friction yields a little below its level, and a limit gives way a little: they are its own laws.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sin

from .two_bodies import Missing, Plant

STEP = 1.0e-4  # s
_ROD = 0.2  # kg·m² at most in a rod: the rest of an inertia is armature


def available() -> str:
    """Return why MuJoCo cannot be used; empty where it can."""
    try:
        import mujoco
    except ImportError as error:
        return f"MuJoCo is not installed ({error}); pip install 'nlsdesign[rigs]'"
    return "" if hasattr(mujoco, "MjModel") else "the package mujoco that is installed has no MjModel"


def scene(plant: Plant, missing: Missing) -> str:
    """Return the machine in MuJoCo's XML; angles in rad, the axis level, gravity straight down.

    Parameters
    ----------
    plant, missing
        As built.
    """
    rigid = not plant.load_inertia
    joint = f'damping="{plant.damping:.9g}" frictionloss="{missing.friction:.9g}"'
    load_joint = f'damping="{plant.load_damping:.9g}" frictionloss="{missing.joint_friction:.9g}"'
    if rigid:
        bodies = _body("motor", joint, plant.inertia, plant.weight)
    elif missing.gap and plant.spring_damping and plant.stiffness > 1e3:
        # A gear: the load hangs on the motor with a joint that moves freely within the gap.
        half = 0.5 * missing.gap
        gap = (
            f'<joint name="gap" type="hinge" axis="0 1 0" limited="true" range="{-half:.9g} {half:.9g}" '
            f'solreflimit="-{plant.stiffness:.9g} -{plant.spring_damping:.9g}" '
            'solimplimit="0.95 0.99 0.0001" damping="1e-6" armature="1e-5"/>'
        )
        inner = _body("load", "", plant.load_inertia, plant.weight, joint_text=gap)
        bodies = _body("motor", joint, plant.inertia, 0.0, inside=inner)
    else:
        bodies = _body("motor", joint, plant.inertia, 0.0)
        bodies += _body("load", load_joint, plant.load_inertia, plant.weight)
    tendon = ""
    if not rigid and "gap" not in bodies:
        reach = 0.5 * missing.gap
        tendon = (
            f'<tendon><fixed name="spring" stiffness="{plant.stiffness:.9g}" '
            f'damping="{plant.spring_damping:.9g}" springlength="{-reach:.9g} {reach:.9g}">'
            '<joint joint="motor" coef="1"/><joint joint="load" coef="-1"/></fixed></tendon>'
        )
    return (
        '<mujoco><compiler angle="radian" inertiafromgeom="false"/>'
        f'<option timestep="{STEP}" integrator="implicitfast" gravity="0 0 -9.81" cone="elliptic">'
        '<flag contact="disable"/></option>'
        f"<worldbody>{bodies}</worldbody>{tendon}</mujoco>"
    )


def _body(
    name: str, joint: str, inertia: float, weight: float, *, inside: str = "", joint_text: str = ""
) -> str:
    """Return a body on a hinge: its mass hangs below the axis, its armature makes up the inertia."""
    # In m; shorter where a heavy and light load would have more inertia on it than it has.
    arm = min(0.1, 4.0 * inertia / weight) if weight else 0.1
    mass = max(weight / (9.81 * arm), 1e-3)
    own = mass * arm * arm
    rod = max(min(0.3 * inertia, _ROD), 1e-7)
    rotor = inertia - own - rod
    hinge = joint_text or f'<joint name="{name}" type="hinge" axis="0 1 0" armature="{rotor:.9g}" {joint}/>'
    if joint_text:
        rod += rotor
    if rotor < 0.0:
        raise ValueError(
            f"{name}: a weight of {weight} N·m on an arm of {arm} m has more inertia than {inertia}"
        )
    where = f"0 0 {-arm}" if weight else "0 0 0"
    rod += 0.0 if weight else own
    return (
        f'<body name="{name}">{hinge}<inertial pos="{where}" mass="{mass:.9g}" '
        f'diaginertia="{rod:.9g} {rod:.9g} {rod:.9g}"/>{inside}</body>'
    )


class MujocoBodies:
    """The plant in time; `advance` takes the effort of each step as `TwoBodies.advance` does."""

    step = STEP

    def __init__(self, plant: Plant, missing: Missing) -> None:
        import mujoco

        self._advance_by_one = mujoco.mj_step
        self.plant, self.missing = plant, missing
        self.model = mujoco.MjModel.from_xml_string(scene(plant, missing))
        self.data = mujoco.MjData(self.model)
        self._on_motor = bool(self.model.nq == 2 and mujoco.mj_name2id(
            self.model, mujoco.mjtObj.mjOBJ_JOINT, "gap") >= 0)  # fmt: skip

    @property
    def place(self) -> float:
        """Angle of the motor, rad."""
        return float(self.data.qpos[0])

    @property
    def load_place(self) -> float:
        """Angle of the second body, rad; that of the motor where there is one body."""
        if self.model.nq == 1:
            return self.place
        return float(self.data.qpos[1] + (self.data.qpos[0] if self._on_motor else 0.0))

    def advance(self, efforts: Sequence[float], payload: float = 0.0) -> None:
        """Go on by one step for each effort on the motor; a payload is a weight of the second body."""
        missing, model, data, advance = self.missing, self.model, self.data, self._advance_by_one
        applied, ripple = data.qfrc_applied, missing.ripple
        order, phase = missing.ripple_order, missing.ripple_phase
        for effort in efforts:
            if ripple:
                effort -= ripple * sin(order * data.qpos[0] + phase)
            if payload:
                pull = payload * sin(self.load_place)
                applied[-1] = -pull
                if self._on_motor:
                    effort -= pull
            applied[0] = effort + (applied[-1] if payload and model.nq == 1 else 0.0)
            advance(model, data)
