"""What is assumed of noise where nobody states it: from the deck's sensors and the sizes of its variables."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...foundation.errors import ValueRangeError
from ...model import FlatModel
from .rest_points import RestPoints


@dataclass(frozen=True)
class NoiseAssumptions:
    """Noise in shares of the sizes that a model has over a sweep; each is a stated guess.

    Parameters
    ----------
    torque
        Torque that changes from sample to sample, as a share of the largest torque at rest.
    inner
        Standard deviation of what the inner states do of their own, as a share of their typical sizes.
    sample_time
        In s.

    Raises
    ------
    ValueRangeError
        If a share is negative, or the sample time not positive.
    """

    torque: float = 0.01
    inner: float = 0.01
    sample_time: float = 1e-3

    def __post_init__(self) -> None:
        if not (self.torque >= 0.0 and self.inner >= 0.0 and 0.0 < self.sample_time < math.inf):
            raise ValueRangeError(str(self), "shares must not be negative, and a sample time positive")

    def process(self, points: RestPoints) -> dict[str, float]:
        """Return the density of white noise of each state, in its unit per √s.

        Parameters
        ----------
        points
            The model at rest at each angle.
        """
        names, largest = points.state_names, np.max(np.abs(points.moving.rates), axis=0)
        decay = np.median(np.abs(np.einsum("Nii->Ni", points.moving.a)), axis=0)
        densities = {}
        for i, name in enumerate(names):
            if name == points.rate:
                densities[name] = self.torque * float(largest[i]) * math.sqrt(self.sample_time)
            elif name != points.angle:
                # With its own decay λ a state of this density has the standard deviation q/√(2λ).
                densities[name] = self.inner * points.sizes[name] * math.sqrt(2.0 * float(decay[i]))
        return densities

    def __str__(self) -> str:
        return (
            f"assumed: a torque of {self.torque:.2g} of the largest one that changes from sample to sample, "
            f"inner states that wander by {self.inner:.2g} of their size, sampled every "
            f"{1e3 * self.sample_time:g} ms"
        )


def declared_deviation(model: FlatModel, name: str) -> float:
    """Return the standard deviation with which a declared sensor shows a variable; quantum/√12 and noise.

    Parameters
    ----------
    model
        As flattened.
    name
        State or signal that is measured.

    Raises
    ------
    ValueRangeError
        If no sensor of it declares a resolution.
    """
    deviations = []
    for reading in model.readings:
        if reading.measured == name:
            numbers = [(model.values.get(f"{s}.noise", 0.0), model.values.get(f"{s}.quantum", 0.0))
                       for s in reading.sensors]  # fmt: skip
            square = sum(noise**2 + quantum**2 / 12.0 for noise, quantum in numbers)
            deviations += [math.sqrt(square)] if square > 0.0 else []
    if not deviations:
        raise ValueRangeError(
            f"measurement of '{name}'", "no sensor in the deck declares its quantum or noise",
            next_step=f"give it: measurement={{'{name}': standard deviation}}, or declare an Encoder of it",
        )  # fmt: skip
    return min(deviations)
