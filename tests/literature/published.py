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

TRELOAR_TENSION = np.array(
    [
        (1.02, 0.26), (1.125, 1.37), (1.24, 2.30), (1.39, 3.23), (1.585, 4.16), (1.90, 5.10),
        (2.18, 6.00), (2.42, 6.90), (3.02, 8.80), (3.57, 10.7), (4.03, 12.5), (4.76, 16.2),
        (5.36, 19.9), (5.75, 23.6), (6.15, 27.4), (6.40, 31.0), (6.60, 34.8), (6.85, 38.5),
        (7.05, 42.1), (7.15, 45.8), (7.25, 49.6), (7.40, 53.3), (7.50, 57.0), (7.60, 64.4),
    ]
)  # fmt: skip
"""Treloar, L. R. G.: Stress-strain data for vulcanised rubber under various types of deformation. Trans.
Faraday Soc. 40, 1944: simple elongation of natural rubber with 8 % sulphur; stretch and nominal stress in
kgf/cm². The points as they are tabulated in the documentation of FElupe (Dutzler 2022)."""

KILOGRAM_FORCE_PER_SQUARE_CENTIMETRE = 98066.5
"""In Pa."""

TRELOAR_SHEAR_MODULUS = 4.0
"""Treloar 1944: modulus of the Gaussian network that he draws through the points, in kgf/cm²."""

OGDEN_1972 = ((6.3, 0.012, -0.1), (1.3, 5.0, -2.0))
"""Ogden, R. W.: Large deformation isotropic elasticity. Proc. R. Soc. A 326, 1972: moduli in kgf/cm² and
exponents for Treloar's rubber, from tension, pure shear and equibiaxial tension together."""

EXTENDED_TUBE_FIT = (0.1867e6, 0.2169e6, 0.2, 0.09693)
"""G_c and G_e in Pa, β and δ for Treloar's rubber; example of the documentation of FElupe (Dutzler 2022)."""
