"""Torque observers: what can be observed, how well with exact numbers, and how well with other rubber."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import nlsdesign as nls
from nlsdesign.bench.identification import rmse
from nlsdesign.feedback.analysis import Chart
from nlsdesign.feedback.observer import ObserverDesign

SETTLED = 1.0  # s; from here on errors count
STIFFER, WIDER = 1.10, 1.05  # of the rubber's moduli and section: one declared spread each
READINGS = {"motor.angle": "motor_encoder.reading"}


@dataclass(frozen=True, eq=False)
class ObserverComparison:
    """Both observers on the same run.

    Parameters
    ----------
    minimal, published
        Designs of the cascade in minimal form, and of the published form.
    bench
        Simulated run with the load side fixed: 6 A at 2 Hz.
    minimal_estimate, published_estimate
        What the observers compute from the reading of the encoder and the current.
    stiffer, stiffer_estimate
        The same run with rubber that is stiffer and wider than the observer knows, and the minimal form's
        estimate.
    """

    minimal: ObserverDesign
    published: ObserverDesign
    bench: nls.Trace
    minimal_estimate: nls.Trace
    published_estimate: nls.Trace
    stiffer: nls.Trace
    stiffer_estimate: nls.Trace

    @property
    def minimal_error(self) -> float:
        """Rms torque error of the minimal form in N·m once it has settled; nominal numbers."""
        return _error(self.minimal_estimate, self.bench)

    @property
    def published_error(self) -> float:
        """Rms torque error of the published form in N·m; nominal numbers."""
        return _error(self.published_estimate, self.bench)

    @property
    def stiffer_error(self) -> float:
        """Rms torque error of the minimal form in N·m where the rubber is stiffer than declared."""
        return _error(self.stiffer_estimate, self.stiffer)


def _error(estimate: nls.Trace, run: nls.Trace) -> float:
    return rmse((estimate["spring.torque"] - run["spring.torque"])[run.time > SETTLED])


def sweep_angle(model: nls.FlatModel, count: int) -> Chart:
    """Compute observability and stability from −50° to 50°."""
    views = [nls.Observability(measured=("motor.angle",)), nls.Stability()]
    angles = np.radians(np.linspace(-50.0, 50.0, count))
    return nls.over_angle(nls.with_outputs(model, ["motor.angle", "spring.torque"]), views, angles=angles)


def with_stiffer_rubber(actuator: nls.Assembly) -> nls.Assembly:
    """Return the actuator with all moduli and the section of the rubber one declared spread larger."""
    changed = {}
    for name, quantity in actuator.quantities().items():
        if name.startswith("spring.rubber.") and name.endswith(".modulus"):
            changed[name] = _times(quantity, STIFFER)
        elif name == "spring.rubber.area":
            changed[name] = _times(quantity, WIDER)
    return actuator.with_values(changed)


def _times(quantity: nls.Quantity, factor: float) -> nls.Quantity:
    values = tuple(factor * each for each in quantity.values)
    return quantity.with_value(values if len(values) > 1 else values[0])


def compare_observers(actuator: nls.Assembly, model: nls.FlatModel, stop: float) -> ObserverComparison:
    """Design both observers and run them on the bench."""
    minimal, published = (
        nls.design_observer_with_details(model),
        nls.design_observer_with_details(model, form=nls.PaperForm()),
    )
    time = np.arange(0.0, stop, minimal.step.sample_time)
    other = nls.flatten(with_stiffer_rubber(actuator), outputs=[v.name for v in model.outputs])
    drive = nls.sine("motor.current", 6.0, 2.0)
    bench, stiffer = (nls.simulate(each, time, inputs=drive, hold=True) for each in (model, other))
    wrong = {"spring.rubber.relaxing.dashpot.strain.memory": 0.05}
    return ObserverComparison(
        minimal,
        published,
        bench,
        nls.observe(minimal.model, bench, readings=READINGS, start=wrong),
        nls.observe(published.model, bench, readings=READINGS),
        stiffer,
        nls.observe(minimal.model, stiffer, readings=READINGS, start=wrong),
    )
