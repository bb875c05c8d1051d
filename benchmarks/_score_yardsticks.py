"""Yardsticks on the same records: a naive F-test, forward selection by BIC, and pysindy.

All see the residual of the refitted declared model, block by block, in units of its noise floor, and the
same table of regressors, filtered as the residual is. Regressors are what a static, linear-in-the-parameters
method can be given of the catalogue: history effects have stand-ins in present values and rates alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from nlsdesign.bench.discrepancy.screening.scale_and_sign import typical_sizes
from nlsdesign.bench.discrepancy.selection.comparison import Comparison
from nlsdesign.bench.discrepancy.tearing import blocks_of
from nlsdesign.bench.identification import RecordSet
from nlsdesign.bench.identification.equation_error.block_noise import rate_span
from nlsdesign.bench.identification.equation_error.evidence import Bench
from nlsdesign.bench.identification.filters import derivative
from nlsdesign.bench.identification.records.measurement import Record
from nlsdesign.components import Assembly
from nlsdesign.foundation.arrays import Array
from nlsdesign.model import flatten

OPEN = 1.4
"""Mean square over the floor from which BIC and pysindy take a block to lack something."""
LEAST_SHARE = 0.5
"""Share of the excess that what they name must explain; else they say ``unknown``."""
SIGNIFICANT = 1e-3
THRESHOLD = 0.25
"""Of STLSQ, on columns of unit size and a residual of unit size; tuned on seeds 1 and 2."""
_ORDERS = tuple(range(4, 61))


class MissingError(Exception):
    """A yardstick whose library is not installed."""


@dataclass(frozen=True)
class Table:
    """Residual and regressors of each block: whitened residual, and columns by effect."""

    residuals: dict[str, Array]
    columns: dict[str, dict[str, Array]]


def table_of(declared: Assembly, records: RecordSet) -> Table:
    """Refit the declared model and tabulate what is left on the fitted records, with the regressors.

    Parameters
    ----------
    declared, records
        As for a diagnosis.
    """
    bench = Bench(records, blocks_of(flatten(declared), records.signals))
    base = Comparison(bench, typical_sizes(declared, records)).base(declared)
    residuals, columns = {}, {}
    for block in blocks_of(flatten(base.fitted), records.signals):
        pieces = bench.evidence(bench.driven(block, []), records.of("fit"), {})
        residuals[block.name] = np.concatenate([e.residual({})[0] for e in pieces])
        given = [_regressors(e.record, torque=block.target is None) for e in pieces]
        columns[block.name] = {
            effect: np.concatenate(
                [
                    (e.floor.filter @ g[effect]) / e.floor.sigma[:, None]
                    for e, g in zip(pieces, given, strict=True)
                ]
            )
            for effect in given[0]
        }  # fmt: skip
    return Table(residuals, columns)


def _regressors(record: Record, *, torque: bool) -> dict[str, Array]:
    """Return the columns of each effect, shape (n, columns), for a torque balance or a force."""

    def signal(name: str) -> str:
        return next(s for s in record.trace.signals if name in s)

    angle, current, force = (record.trace[signal(n)] for n in ("encoder", "current", "force"))
    h, span = record.step, rate_span([record], signal("encoder"))
    speed = derivative(angle, h, order=1, span=span)
    slope, later = np.gradient(force, h), np.linspace(0.0, 1.0, len(angle))
    one, sign, way = np.ones_like(angle), np.tanh(speed / 0.05), np.tanh(speed * np.sign(angle) / 0.05)
    if torque:
        found = {
            "coulomb_friction": [sign],
            "stribeck_friction": [sign, sign * np.exp(-((speed / 0.3) ** 2))],
            "load_dependent_friction": [sign * np.abs(force * angle)],
            "quadratic_drag": [speed * np.abs(speed)],
            "current_sensor_bias": [one],
            "torque_constant_saturation": [current * np.abs(current), current**3],
            "drive_delay": [np.gradient(current, h)],
            "backlash": [np.tanh(angle / 0.02)],
            "cam_angle_offset": [np.cos(angle), np.abs(angle)],
        }
        found |= {f"torque_ripple@{n}": [np.sin(n * angle), np.cos(n * angle)] for n in _ORDERS}
    else:
        stretch = np.abs(angle)
        found = {
            "force_sensor_bias": [one],
            "force_sensor_gain": [force],
            "force_sensor_delay": [slope],
            "force_sensor_drift": [later],
            "cable_compliance": [force * np.abs(force)],
            "cable_slack": [np.tanh(stretch / 0.05)],
            "cam_angle_offset": [np.sign(angle) * stretch, np.sign(angle) * stretch**2],
            "backlash": [np.tanh(stretch / 0.02), stretch],
            "strain_stiffening": [stretch**3, stretch**5],
            "second_relaxation": [force * later, np.abs(speed) * way],
            "rate_independent_hysteresis": [way],
            "stress_softening": [force * (1.0 - way)],
            "self_heating": [force * np.cumsum(np.abs(slope)) / np.sum(np.abs(slope))],
            "angle_sensor_eccentricity": [np.sin(angle), 1.0 - np.cos(angle)],
        }
    return {effect: np.column_stack(each) for effect, each in found.items()}


def f_test(table: Table) -> list[str]:
    """Name the most significant effect, each residual taken for independent noise.

    Parameters
    ----------
    table
        Of one case.
    """
    best = (SIGNIFICANT, "")
    for block, residual in table.residuals.items():
        n, whole = len(residual), float(residual @ residual)
        for effect, columns in table.columns[block].items():
            k, left = columns.shape[1], _left(residual, columns)
            p = float(stats.f.sf((whole - left) / k / (left / (n - k)), k, n - k))
            best = min(best, (p, effect))
    return _names([best[1]] if best[1] else [])


def forward_bic(table: Table) -> list[str]:
    """Add the effect that lowers n·ln(RSS/n) + k·ln(n) most, as long as one does, in each open block.

    Parameters
    ----------
    table
        Of one case.
    """

    def chosen(block: str, residual: Array) -> list[str]:
        columns, taken, present = table.columns[block], [], np.zeros((len(residual), 0))
        least = len(residual) * np.log(np.mean(residual**2))
        while len(taken) < 3:
            looks = {
                e: _bic(residual, np.column_stack([present, c])) for e, c in columns.items() if e not in taken
            }
            effect = min(looks, key=lambda e: looks[e])
            if looks[effect] >= least:
                break
            least, present = looks[effect], np.column_stack([present, columns[effect]])
            taken.append(effect)
        return taken

    return _open_blocks(table, chosen)


def _bic(residual: Array, columns: Array) -> float:
    n = len(residual)
    return float(n * np.log(_left(residual, columns) / n) + columns.shape[1] * np.log(n))


def stlsq(table: Table) -> list[str]:
    """Sequentially thresholded least squares of pysindy.

    Parameters
    ----------
    table
        Of one case.
    """
    return _open_blocks(table, lambda b, r: _sparse(table, b, r, lambda p: p.STLSQ(threshold=THRESHOLD)))


def frols(table: Table) -> list[str]:
    """Forward orthogonal least squares of pysindy.

    Parameters
    ----------
    table
        Of one case.
    """
    return _open_blocks(table, lambda b, r: _sparse(table, b, r, lambda p: p.FROLS(max_iter=3)))


def ensemble(table: Table) -> list[str]:
    """Bagged STLSQ of pysindy: the median of 20 fits to resampled rows.

    Parameters
    ----------
    table
        Of one case.
    """

    def made(p: Any) -> Any:
        return p.EnsembleOptimizer(p.STLSQ(threshold=THRESHOLD), bagging=True, n_models=20)

    return _open_blocks(table, lambda b, r: _sparse(table, b, r, made))


def _sparse(table: Table, block: str, residual: Array, make: Callable[[Any], Any]) -> list[str]:
    """Return effects in the order of the size of their terms."""
    try:
        from pysindy import optimizers
    except ImportError:
        raise MissingError("pysindy is not installed") from None
    owners: list[str] = []
    kept: list[Array] = []
    for effect, columns in table.columns[block].items():
        for column in columns.T:
            # A column that an earlier effect brought is not offered twice: Stribeck adds to Coulomb.
            if not any(np.array_equal(column, other) for other in kept):
                owners.append(effect)
                kept.append(column)
    together = np.column_stack(kept)
    size = np.maximum(np.sqrt(np.mean(together**2, axis=0)), 1e-300)
    scale = np.sqrt(np.mean(residual**2))
    np.random.seed(0)
    found = make(optimizers).fit(together / size, (residual / scale)[:, None])
    weight: dict[str, float] = {}
    for effect, coefficient in zip(owners, np.ravel(found.coef_), strict=True):
        if coefficient != 0.0:
            weight[effect] = weight.get(effect, 0.0) + float(coefficient) ** 2
    if "stribeck_friction" in weight:
        weight.pop("coulomb_friction", None)
    return sorted(weight, key=lambda e: -weight[e])


def _open_blocks(table: Table, choose: Callable[[str, Array], Sequence[str]]) -> list[str]:
    """Return what is chosen in the open blocks, worst first; ``unknown`` where it explains little."""
    ratio = {b: float(np.mean(r**2)) for b, r in table.residuals.items()}
    found: list[str] = []
    for block in sorted((b for b in ratio if ratio[b] > OPEN), key=lambda b: -ratio[b]):
        residual = table.residuals[block]
        effects = list(choose(block, residual))
        whole = float(residual @ residual) - len(residual)
        columns = [table.columns[block][e] for e in effects]
        left = _left(residual, np.column_stack(columns)) - len(residual) if columns else whole
        found += effects if 1.0 - left / whole >= LEAST_SHARE else ["unknown"]
    return _names(found)


def _left(residual: Array, columns: Array) -> float:
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    fitted, *_ = np.linalg.lstsq(columns / size, residual, rcond=1e-10)
    rest = residual - (columns / size) @ fitted
    return float(rest @ rest)


def _names(effects: Sequence[str]) -> list[str]:
    """Return effects without the order of a ripple, each once."""
    return list(dict.fromkeys(e.partition("@")[0] for e in effects))


YARDSTICKS: dict[str, Callable[[Table], list[str]]] = {
    "F-test": f_test,
    "BIC": forward_bic,
    "pysindy STLSQ": stlsq,
    "pysindy FROLS": frols,
    "pysindy ensemble": ensemble,
}
