"""A whole design study on one page: declare an actuator, design its cam, observe its torque."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.components import Fixed, GearedMotor, NeoHooke, TwoSidedCam


@dataclass(frozen=True)
class Results:
    """The numbers that ``expected.toml`` claims."""

    design_error_mNm_rms: float
    observability_rank_at_20_deg: float
    observer_error_mNm_rms: float
    numbers = property(asdict, doc="The results by name.")


def main(out: Path, fast: bool = False) -> Results:
    """Design a stiffening spring for 2 N·m at 40° and an observer of its torque."""
    # Declare: a motor turns a cam whose cable stretches rubber on both sides; the rubber relaxes in 50 ms.
    q, neo_hooke = nls.quantity, NeoHooke(shear_modulus=nls.quantity(0.5, "MPa"))
    law = nls.standard_linear_solid(neo_hooke, modulus=q(0.4, "MPa"), viscosity=q(20.0, "kPa*s"))
    rubber = nls.specimen(area=q(1.0, "cm^2"), rest_length=q(20.0, "mm"), law=law)
    cam = TwoSidedCam(lever_arm=q((12.0,) * 20, "mm"), last_angle=q(50.0, "deg"))
    spring = nls.tie(nls.through(cam, rubber=rubber, pretension=q(1.0, "mm")), "motor", "load")
    motor = GearedMotor(inertia=q(6e-4, "kg*m^2"), gear_ratio=q(4.0, "1"), torque_constant=q(55.0, "mN*m/A"))
    actuator = nls.assembly("hello", motor=motor, load=Fixed(), spring=spring)
    # Design cam, pretension and section of the rubber together, within limits.
    target = nls.ExponentialTorque(maximum=2.0, angle=nls.degrees(40.0), shape=1.0)
    limits = [nls.MinimumRadiusOfCurvature(1e-3), nls.MaximumCamRadius(0.03), nls.MaximumStrain(1.0)]
    free = ["spring.cam.contour", "spring.pretension", "spring.rubber.area"]
    design = nls.design_cam(actuator, target=target, free=free, keep=limits)
    # Flatten to one model. Does the angle of the motor show all of its states?
    model = nls.flatten(design.actuator, outputs=["motor.angle", "spring.torque"])
    chart = nls.over_angle(model, [nls.Observability(measured=("motor.angle",))], angles=[nls.degrees(20.0)])
    # Observe the torque of a simulated run from angle and current; the first half is for settling.
    time, drive = np.arange(0.0, 1.0, 1e-3), nls.sine("motor.current", 5.0, 2.0)
    run = nls.simulate(model, time, inputs=drive, hold=True)
    estimate = nls.observe(nls.design_observer(model), run)["spring.torque"]
    error = float(np.sqrt(np.mean((estimate - run["spring.torque"])[500:] ** 2)))
    remark = f"An observer knows its torque from angle and current within {1e3 * error:.2g} mN·m rms."
    nls.report.write_design_report(out / "report.html", design, deck="hello", remarks=(remark,))
    return Results(1e3 * design.rms, float(chart["observability.rank"][0]), 1e3 * error)
