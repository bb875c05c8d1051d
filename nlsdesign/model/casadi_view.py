"""A flat model as plain CasADi, for its integrators and optimal control."""

from __future__ import annotations

import casadi as ca

from ..foundation.errors import ValueRangeError
from .flat import FlatModel


def casadi_dae(model: FlatModel) -> dict[str, ca.SX]:
    """Return a continuous model as the mapping that ``casadi.integrator`` takes.

    Parameters
    ----------
    model
        Continuous, without tables.

    Returns
    -------
    dict
        SX columns: ``t``, ``x``, ``u``, ``p``, ``ode``, and ``y`` with the outputs, in the order of
        ``model.states``, ``inputs``, ``parameters`` and ``outputs``. Take ``y`` out for an integrator.

    Raises
    ------
    ValueRangeError
        If the model is sampled or has tables.

    Examples
    --------
    >>> import casadi, nlsdesign as nls
    >>> model = nls.flatten(nls.declare(nls.load_deck("dfki_pendulum")))
    >>> dae = nls.model.casadi_dae(model)
    >>> outputs = dae.pop("y")
    >>> run = casadi.integrator("run", "cvodes", dae, 0.0, 0.1)
    >>> end = run(x0=model.start(model.states), u=[0.5], p=model.start(model.parameters))["xf"]
    >>> end.shape
    (2, 1)
    """
    if model.sample_time is not None or model.tables:
        raise ValueRangeError(
            f"model '{model.name}'",
            "is sampled, an integrator takes a continuous one",
            next_step="call model.equations, which gives the states one sample later",
        )
    s = model.symbols()
    return {"t": s.time, "x": s.state, "u": s.input, "p": s.parameter, "ode": s.derivative, "y": s.output}
