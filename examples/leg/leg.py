"""One leg with three series elastic joints walks in MuJoCo: from the gait of people to motor currents.

    python leg.py [STRIDES]

Hip, knee and ankle have the published actuator each, on a frame that holds the hip. Every millisecond the
generated step of observer and torque controller, compiled as it goes onto a controller, reads the counts of a
deflection and gives a current. The torques of the gait are those of a thirtieth of a person of 75 kg. Ground
and the rest of the body act as the torques that are missing then: what the motion of this leg needs less what
the muscles of the gait give.
"""

import importlib
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

import nlsdesign as nls
from nlsdesign.components import Inertia
from nlsdesign.export.compilation.compiled_step import CompiledStep

DECK, SHARE, BODY_MASS = "austin2015_figure_consistent", 1.0 / 30.0, 75.0
JOINTS = ("hip", "knee", "ankle")
LENGTHS, MASSES = (0.21, 0.20, 0.14), (0.4, 0.3, 0.2)  # m and kg of thigh, shank and foot: invented
STIFFNESS, DAMPING = (5.0, 2.0, 0.8), (0.2, 0.08, 0.03)  # N·m/rad, N·m·s/rad that hold a joint to its motion
STEP = 1e-3  # s


class Gait(NamedTuple):
    """A stride, by joint: angle, speed, acceleration and muscle torque at each sample."""

    angle: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray


def gait() -> Gait:
    """Return a stride at 1 kHz, shape (samples, joints), with the torques of this leg's share."""
    cycles = []
    for joint in JOINTS:
        task = nls.design.walking_task(joint, body_mass=SHARE * BODY_MASS)
        cycles.append(task.sampled(round(task.period / STEP)))
    rows = {name: np.array([getattr(c, name) for c in cycles]).T for name in Gait._fields}
    return Gait(**rows)


def robot(name: str, inner: int) -> str:
    """Return the MJCF: each joint is the load of an actuator, its rotor turns beside it."""
    bodies, ends = "", ""
    start = "0 0 0"
    for joint, length, mass in zip(JOINTS, LENGTHS, MASSES, strict=True):
        way = "0 0 -1" if joint != "ankle" else "1 0 0"
        end = " ".join(f"{length * float(w):g}" for w in way.split())
        bodies += f"""
<body name="{joint}_rotor" pos="{start}">
  <joint name="{joint}_motor" type="hinge" axis="0 -1 0" armature="{rotor_inertia():.6g}"/>
  <inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/></body>
<body name="{joint}" pos="{start}"><joint name="{joint}_load" type="hinge" axis="0 -1 0"/>
  <geom type="capsule" fromto="0 0 0 {end}" size="0.015" mass="{mass}" contype="0" conaffinity="0"/>"""
        ends, start = f"{ends}</body>", end
    drives = "".join(
        f"""<general name="{joint}_motor.current" joint="{joint}_motor" gear="4" gainprm="0.055"
 ctrlrange="-20 20"/>
<general name="{joint}_load.torque" joint="{joint}_load"/>
<general name="{joint}_inner_states" joint="{joint}_motor" dyntype="user" actdim="{inner}" gainprm="0"/>"""
        for joint in JOINTS
    )
    instances = "".join(
        f'<instance name="{joint}"><config key="prefix" value="{joint}_"/></instance>' for joint in JOINTS
    )
    return f"""<mujoco model="leg"><compiler angle="radian" autolimits="true"/>
<option timestep="{STEP}" integrator="RK4"/>
<extension><plugin plugin="nlsdesign.{name}">{instances}</plugin></extension>
<worldbody><body name="pelvis" pos="0 0 1">{bodies}{ends}</body></worldbody>
<actuator>{drives}</actuator></mujoco>"""


def machine() -> nls.FlatModel:
    """Return the actuator with a load that moves freely; its inertia is that of the links in MuJoCo."""
    return nls.flatten(
        nls.declare(nls.load_deck(DECK)).with_part("load", Inertia(inertia=1e-3)),
        outputs=["spring.torque"],
    )


def rotor_inertia() -> float:
    """Return the inertia of a motor at its joint, kg·m²."""
    return float(machine().values["motor.inertia"])


def missing_torques(model: mujoco.MjModel, stride: Gait, places: list[int]) -> np.ndarray:
    """Return what ground and body give at each sample: this motion's need less the muscles."""
    data, needed = mujoco.MjData(model), np.zeros_like(stride.torque)
    rotors = [model.joint(f"{joint}_motor").dofadr[0] for joint in JOINTS]
    for k in range(len(needed)):
        for moved in (places, rotors):
            data.qpos[moved], data.qvel[moved] = stride.angle[k], stride.speed[k]
            data.qacc[moved] = stride.acceleration[k]
        mujoco.mj_inverse(model, data)
        needed[k] = data.qfrc_inverse[places]
    return needed - stride.torque


def walk(strides: int, folder: Path) -> dict[str, dict[str, float]]:
    """Walk; return for each joint the errors of torque and angle, the largest torque, and the currents."""
    plant = nls.flatten(nls.declare(nls.load_deck(DECK)))
    both = nls.control.joined(
        nls.design_observer(plant, gain=nls.observer.CascadeGain()),
        nls.torque_controller(plant, law=nls.control.ScheduledTorque()),
    )
    source = nls.export_c(both, folder / "c", real="float", name="torque_loop")
    steps = {joint: CompiledStep(source) for joint in JOINTS}
    written = nls.export.export_mujoco(machine(), folder / "mujoco")
    sys.path.insert(0, str(written.module.parent))
    actuator = importlib.import_module(written.name)
    actuator.load_plugin()
    model = mujoco.MjModel.from_xml_string(robot(written.name, len(actuator.INNER)))
    data, stride = mujoco.MjData(model), gait()
    laws = [actuator.Law(model, prefix=f"{joint}_") for joint in JOINTS]
    loads, motors = ([model.joint(f"{j}_{k}").dofadr[0] for j in JOINTS] for k in ("load", "motor"))
    data.qpos[loads] = data.qpos[motors] = stride.angle[0]
    data.qvel[loads] = data.qvel[motors] = stride.speed[0]
    outside, quantum = missing_torques(model, stride, loads), plant.values["motor_encoder.quantum"]
    names = [v.name for v in both.outputs]
    current = names.index("motor.current")
    seen, period = [], len(stride.angle)
    for k in range(strides * period):
        row = k % period
        joint_angle, joint_speed = data.qpos[loads], data.qvel[loads]
        wish = stride.torque[row] + STIFFNESS * (stride.angle[row] - joint_angle)
        wish = np.clip(wish + DAMPING * (stride.speed[row] - joint_speed), -4.3, 4.3)
        counts = np.rint((data.qpos[motors] - joint_angle) / quantum)
        given = [steps[j]([quantum * n, w])[0] for j, n, w in zip(JOINTS, counts, wish, strict=True)]
        torque = [law.outputs(data)["spring.torque"] for law in laws]
        seen.append([wish, torque, [y[current] for y in given], joint_angle - stride.angle[row]])
        for i, joint in enumerate(JOINTS):
            data.actuator(f"{joint}_load.torque").ctrl[0] = outside[row, i]
        mujoco.mj_step(model, data)
        for joint, y in zip(JOINTS, given, strict=True):  # acts from the next sample on
            data.actuator(f"{joint}_motor.current").ctrl[0] = y[current]
    table = np.array(seen)[period:]  # the first stride begins without deflection
    if not np.isfinite(table).all():
        raise SystemExit("the leg has fallen apart: a number is not finite")
    return {
        joint: {
            "torque error, mN·m rms": 1e3 * float(np.sqrt(np.mean((table[:, 0, i] - table[:, 1, i]) ** 2))),
            "angle error, deg rms": float(np.degrees(np.sqrt(np.mean(table[:, 3, i] ** 2)))),
            "largest torque, N·m": float(np.abs(table[:, 1, i]).max()),
            "current, A rms": float(np.sqrt(np.mean(table[:, 2, i] ** 2))),
            "largest current, A": float(np.abs(table[:, 2, i]).max()),
        }
        for i, joint in enumerate(JOINTS)
    }


def main() -> None:
    """Walk some strides and print a table."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        results = walk(max(2, int(sys.argv[1]) if len(sys.argv) > 1 else 3), Path(folder))
    print("joint, " + "; ".join(results["hip"]))
    for joint, numbers in results.items():
        print(f"{joint}, " + "; ".join(f"{value:.3g}" for value in numbers.values()))


if __name__ == "__main__":
    main()
