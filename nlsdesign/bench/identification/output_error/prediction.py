"""How far a simulation runs away from a record within a window that begins at the measured state."""

from __future__ import annotations

from typing import NamedTuple

from ....foundation.arrays import Array
from ....foundation.errors import MeasurementError
from ....model import FlatModel
from ..records.measurement import Record
from ..statistics.metrics import rmse
from .simulation_error import Shots, SimulationError
from .wiring import Wiring


class Prediction(NamedTuple):
    """A record as predicted in windows.

    Parameters
    ----------
    time
        Of the samples in whole windows, in s, shape (n,).
    error
        Predicted minus measured by name of the measured signal, in SI, shape (n,).
    """

    time: Array
    error: dict[str, Array]

    def rmse(self, signal: str) -> float:
        """Return the root mean square error over all windows.

        Parameters
        ----------
        signal
            Name of the measured signal.
        """
        return rmse(self.error[signal])


def predict_in_windows(
    model: FlatModel, record: Record, length: float, *, wiring: Wiring | None = None, substeps: int = 1
) -> Prediction:
    """Simulate a record in windows, each from the measured state, driven by the measured inputs.

    Parameters
    ----------
    model
        Continuous, without tables.
    record
        Measured.
    length
        Of a window in s; a last window that is not whole is left out.
    wiring
        By name where ``None``.
    substeps
        Integration steps from sample to sample.

    Raises
    ------
    MeasurementError
        If the record is shorter than one window.
    ConvergenceError
        If a simulation is not finite.
    """
    if length > record.trace.time[-1] - record.trace.time[0] + 0.5 * record.step:
        raise MeasurementError(
            f"record '{record.name}'",
            f"lasts {record.trace.time[-1] - record.trace.time[0]:g} s, which is less than {length:g} s",
            next_step="take shorter windows",
        )
    problem = SimulationError(
        model, [record], [], shots=Shots(length, False, substeps), wiring=wiring, slopes=False
    )
    (windows,) = problem.windows
    kept = (len(record.trace) // windows.count) * windows.count
    rows = problem.residual(problem.start()).reshape(len(problem.sigma), -1) * problem.sigma[:, None]
    error = {name: rows[i, :kept] for i, name in enumerate(problem.wiring.outputs)}
    return Prediction(record.trace.time[:kept], error)
