"""Torque observers of the published actuator: what can be observed, and how well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import nlsdesign as nls
from nlsdesign.analysis import Chart
from nlsdesign.identification import rmse
from nlsdesign.observer import ObserverDesign

SETTLED = 1.0  # s; from here on errors count


@dataclass(frozen=True, eq=False)
class ObserverComparison:
    """Both observers on the same run.

    Parameters
    ----------
    minimal
        Design of the minimal form.
    bench
        Simulated run with the load side fixed: 6 A at 2 Hz.
    minimal_estimate, published_estimate
        What the observers compute from the reading of the encoder and the current.
    free
        Simulated run with a light link in place of the fixed load side.
    """

    minimal: ObserverDesign
    bench: nls.Trace
    minimal_estimate: nls.Trace
    published_estimate: nls.Trace
    free: nls.Trace

    def error(self, estimate: nls.Trace) -> float:
        """Return the rms torque error of an estimate in N·m, once it has settled."""
        return rmse((estimate["spring.torque"] - self.bench["spring.torque"])[self.bench.time > SETTLED])


def sweep_angle(model: nls.FlatModel, count: int) -> Chart:
    """Compute observability and stability from −50° to 50°."""
    views = [nls.Observability(measured=("motor.angle",)), nls.Stability()]
    angles = np.radians(np.linspace(-50.0, 50.0, count))
    return nls.over_angle(nls.with_outputs(model, ["motor.angle", "spring.torque"]), views, angles=angles)


def compare_observers(actuator: nls.Assembly, model: nls.FlatModel, stop: float) -> ObserverComparison:
    """Design both observers and run them on the bench; simulate the free drivetrain as well."""
    minimal, published = (
        nls.design_observer_with_details(model),
        nls.design_observer_with_details(model, form=nls.PaperForm()),
    )
    time = np.arange(0.0, stop, minimal.step.sample_time)
    link = nls.Inertia(inertia=nls.quantity(2e-3, "kg*m^2", source="assumed: a light link"))
    free = nls.flatten(actuator.with_part("load", link), inputs=["motor.current"])
    bench = nls.simulate(model, time, inputs=nls.sine("motor.current", 6.0, 2.0), hold=True)
    readings = {"motor.angle": "motor_encoder.reading"}
    wrong = {"spring.rubber.relaxing.dashpot.strain.memory": 0.05}
    return ObserverComparison(
        minimal,
        bench,
        nls.observe(minimal.model, bench, readings=readings, start=wrong),
        nls.observe(published.model, bench, readings=readings),
        nls.simulate(free, time, inputs=nls.sine("motor.current", 0.5, 2.0), hold=True),
    )
