"""A step of the published actuator in MuJoCo, against actuators that MuJoCo has, on the same bodies.

Ours is the engine plug-in with the laws of the deck: cam, rubber that relaxes, friction. The peers have what
MuJoCo offers in their place: a linear spring on the joint, damping, ``frictionloss``, and a ``position``
servo or a motor. All are stepped with RK4 at 1 ms; the fastest of several runs counts, in time of the
processor.

Run: ``python -m benchmarks.mujoco_actuator [--steps 20000] [--runs 15]``.
"""

from __future__ import annotations

import argparse
import importlib.util
import tempfile
import time
from pathlib import Path

import mujoco

import nlsdesign as nls
from nlsdesign.export import export_mujoco

DECK = "austin2015_figure_consistent"
PEERS = {
    "position": '<position name="drive" joint="motor" kp="5"/>',
    "motor": '<motor name="drive" joint="motor"/>',
}
PEER = """<mujoco>
  <option timestep="0.001" integrator="RK4" gravity="0 0 0"/>
  <worldbody>
    <body name="motor">
      <inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/>
      <joint name="motor" type="hinge" axis="0 0 1" stiffness="3" damping="{damping}" frictionloss="0.02"/>
    </body>
  </worldbody>
  <actuator>{actuator}</actuator>
</mujoco>"""


def fastest(model: mujoco.MjModel, steps: int, runs: int) -> float:
    """Return seconds of the processor for one step, the least of several runs from the same start."""
    times = []
    for _ in range(runs):
        data = mujoco.MjData(model)
        data.ctrl[0] = 0.5
        begin = time.process_time()
        mujoco.mj_step(model, data, nstep=steps)
        times.append((time.process_time() - begin) / steps)
    return min(times)


def main() -> None:
    """Print the time of a step and its ratio to each peer's."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=20000)
    parser.add_argument("--runs", type=int, default=15)
    given = parser.parse_args()
    plant = nls.flatten(nls.declare(nls.load_deck(DECK)))
    with tempfile.TemporaryDirectory() as folder:
        written = export_mujoco(plant, Path(folder))
        spec = importlib.util.spec_from_file_location(written.name, written.module)
        assert spec is not None
        assert spec.loader is not None
        actuator = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(actuator)
        actuator.load_plugin()
        ours = fastest(mujoco.MjModel.from_xml_path(str(written.plugin_scene)), given.steps, given.runs)
    print(f"MuJoCo {mujoco.__version__}, RK4 at 1 ms")
    print(f"plug-in with the laws of the deck: {1e6 * ours:.2f} µs a step")
    numbers = {"inertia": plant.values["motor.inertia"], "damping": plant.values["bearing.damping"]}
    for name, text in PEERS.items():
        peer = mujoco.MjModel.from_xml_string(PEER.format(actuator=text, **numbers))
        theirs = fastest(peer, given.steps, given.runs)
        print(
            f"{name}, spring and friction of MuJoCo: {1e6 * theirs:.2f} µs, ours over it {ours / theirs:.2f}"
        )


if __name__ == "__main__":
    main()
