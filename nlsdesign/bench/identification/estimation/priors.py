"""What is known of parameters before a fit, as rows of least squares."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ....foundation.arrays import Array
from .least_squares import Fit
from .parameters import Parameter

_LEAST = 1e-12


def prior_rows(parameters: Sequence[Parameter], known: Sequence[Fit] = ()) -> tuple[Array, Array]:
    """Return M and m, so that M·x − m are the residuals of everything known before, x in the fitted scale.

    ``parameters``: in the order of x; those with a finite sigma give a row each. ``known``: earlier fits;
    each gives as many rows as it has parameters among these, correlated as they were.
    """
    names = [p.name for p in parameters]
    rows = [np.diag([1.0 / p.sigma for p in parameters]).reshape(len(names), len(names))]
    centres = [
        np.array([p.inward(p.centre) / p.sigma if math.isfinite(p.sigma) else 0.0 for p in parameters])
    ]
    for fit in known:
        places = [(i, names.index(p.name)) for i, p in enumerate(fit.parameters) if p.name in names]
        if not places:
            continue
        own, columns = (list(side) for side in zip(*places, strict=True))
        # From the scale of the earlier fit to that of this one, at the value found.
        ratio = np.array(
            [
                fit.parameters[i].slope(fit.values[names[j]]) / parameters[j].slope(fit.values[names[j]])
                for i, j in places
            ]
        )
        covariance = fit.covariance[np.ix_(own, own)] * np.outer(ratio, ratio)
        strength, axes = np.linalg.eigh(covariance)
        whitened = (axes / np.sqrt(np.maximum(strength, _LEAST * strength.max()))).T
        wide = np.zeros((len(own), len(names)))
        wide[:, columns] = whitened
        rows.append(wide)
        centres.append(whitened @ np.array([parameters[j].inward(fit.values[names[j]]) for j in columns]))
    return np.vstack(rows), np.concatenate(centres)
