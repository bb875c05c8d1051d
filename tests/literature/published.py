"""Small tables of published numbers, each with its source; angles in rad, everything else in the unit named.

Austin, J., Schepelmann, A., Geyer, H.: Control and evaluation of series elastic actuators with nonlinear
rubber springs. IROS 2015. Points of figures were read off the vector graphics of the paper.
Schepelmann, A., Geberth, K. A., Geyer, H.: Compact nonlinear springs with user defined torque-deflection
profiles for series elastic actuators. ICRA 2014.
"""

from __future__ import annotations

import numpy as np

FIG_8_NONLINEAR = np.array(
    [
        (-0.698151, -2.15344),
        (-0.61089, -1.64107),
        (-0.523629, -1.22142),
        (-0.436346, -0.760942),
        (-0.349079, -0.445837),
        (-0.261818, -0.194783),
        (-0.174557, -0.0510164),
        (-0.0872961, -0.0124912),
        (-3.51449e-05, 0.000180239),
        (0.0872314, 0.0110258),
        (0.174515, 0.0454245),
        (0.261776, 0.139565),
        (0.349036, 0.410594),
        (0.436303, 0.715839),
        (0.523564, 1.15704),
        (0.610825, 1.58783),
        (0.698108, 2.08836),
        (0.785374, 2.43812),
    ]
)
"""IROS 2015, Fig. 8: angle in rad and torque in N·m of the nonlinear spring, measured."""

FIG_8_SOFT = np.array(
    [
        (-0.436346, -0.762366),
        (-0.349079, -0.613742),
        (-0.261818, -0.467966),
        (-0.174557, -0.319891),
        (-0.0872961, -0.162722),
        (-3.51449e-05, -0.0135138),
        (0.0872314, 0.158116),
        (0.174515, 0.303891),
        (0.261776, 0.44554),
        (0.349036, 0.59431),
        (0.436303, 0.735083),
    ]
)
"""IROS 2015, Fig. 8: angle in rad and torque in N·m of the soft linear spring, measured."""

MODEL_RMSE = 0.10
"""IROS 2015: root mean square error of the authors' own model, N·m."""

MODEL_RELATIVE_ERROR = 13.6
"""IROS 2015: mean relative error of the authors' own model, per cent."""

AREA, REST_LENGTH = 1e-4, 0.0125
"""IROS 2015: printed A₀ = 1 cm² and L₀ = 1.25 cm, in m² and m."""

MODULI = (0.92e6, 0.58e6, 0.74e6, 0.77e6, 0.47e6, 1.06e6)
ENGAGING = (0.0, 0.20e-3, 1.06e-3, 2.65e-3, 9.04e-3, 9.05e-3)
BRANCH, VISCOSITY = 0.58e6, 411.0
"""IROS 2015: printed k* in Pa, engaging extensions in m, k in Pa, η in Pa·s."""

FORCES = (
    (0.2e-3, 1.5),
    (1.06e-3, 11.8),
    (1.78e-3, 24.7),
    (3.5e-3, 60.8),
    (5e-3, 97.0),
    (9.04e-3, 194.0),
    (12e-3, 302.0),
)
"""Extension in m and static force in N of the printed law, rounded as in the project's design notes."""

TARGET_TORQUE, TARGET_ANGLE = 5.0, np.radians(53.0)
"""ICRA 2014: 5 N·m at 53°, torque growing like e^θ − 1."""

SOFT_STIFFNESS, STIFF_STIFFNESS = 1.7, 3.4
"""IROS 2015: the two linear springs, N·m/rad."""
