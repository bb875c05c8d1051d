"""``--flash`` and ``--table-error``: how large generated code may be, and what that costs in torque."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from ..foundation.errors import ExportError, ValueRangeError
from ..foundation.quantity import typeset_unit
from ..foundation.written_numbers import prefixed
from .units import Bytes, Number

if TYPE_CHECKING:
    from ..feedback.observer import DesignedObserver, GridByTorqueError
    from ..feedback.observer.scheduling.torque_grid import TableTooLargeError
    from ..model import FlatModel

ATTEMPTS = 3
"""Designs until code and table together keep a size; a coarser table changes the code a little."""
F = TypeVar("F", bound=Callable[..., Any])


def flash_options(command: F) -> F:
    """Add ``--flash`` and ``--table-error``."""
    command = click.option(
        "--flash", type=Bytes(), metavar="SIZE",
        help="Most flash of code and tables on a Cortex-M4F, for instance 16kB; the table is made coarser "
        "for it, and what that costs is said.",
    )(command)  # fmt: skip
    return click.option(
        "--table-error", type=Number("N*m", above=0.0), metavar="TORQUE",
        help="Torque error that the table may cause, for instance 1mN.m.  [default: 0.02 % of the largest "
        "torque]",
    )(command)  # fmt: skip


@dataclass(frozen=True, eq=False)
class SizedObserver:
    """An observer and what it takes.

    Parameters
    ----------
    designed
        The observer.
    code
        Flash of the code in bytes, without tables; ``None`` where no compiler is installed.
    tables
        Flash of the tables in bytes.
    """

    designed: DesignedObserver
    code: int | None
    tables: int

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the table costs, and how large everything is."""
        compact, unit = self.designed.design.compact, typeset_unit(self.designed.design.model.outputs[0].unit)
        kind = "uniform" if compact.uniform else "by breakpoints"
        error = compact.torque_error
        words = f"table: {len(compact.angles)} angles {kind}, {len(compact.columns)} columns"
        if error is not None:
            words += (
                f"; it moves the torque by at most {prefixed(error.largest, unit)}, "
                f"{prefixed(error.rms, unit, digits=2)} rms, of {error.full_scale:.3g} {unit} "
                f"({100.0 * error.share:.2g} %)"
            )
        if self.code is None:
            return words, f"flash of the tables: {self.tables} B; the code was not measured: no compiler"
        total = f"flash on a Cortex-M4F: {self.code + self.tables} B"
        return words, f"{total} ({self.code} B code with what it calls, {self.tables} B tables)"


def sized_observer(
    plant: FlatModel,
    sample_time: float,
    *,
    real: str,
    flash: int | None = None,
    table_error: float | None = None,
    part_of: Callable[[FlatModel], FlatModel] = lambda observer: observer,
    **chosen: Any,
) -> SizedObserver:
    """Design an observer whose code and tables keep a size.

    ``part_of``: makes what is exported of the observer; by default that is the observer alone.
    """
    from ..feedback.observer import designed_observer
    from ..feedback.observer.scheduling.torque_grid import TableTooLargeError

    each = 4 if real == "float" else 8
    grid = _grid(plant, table_error, each, None)
    designed = designed_observer(plant, sample_time=sample_time, grid=grid, **chosen)
    first = _sized(designed, part_of(designed.model), real, needed=flash is not None)
    if flash is None or first.code is None or first.code + first.tables <= flash:
        return first
    current, chosen = first, {**chosen, "kind": designed.kind}
    for _ in range(ATTEMPTS):
        most = max(flash - (current.code or 0), 1)
        if not current.tables:
            raise ValueRangeError(
                f"flash of {flash} B", f"the code alone takes {current.code} B on a Cortex-M4F",
                next_step=f"allow {current.code} B, or take another --kind or --real float",
            )  # fmt: skip
        grid = _grid(plant, table_error, each, most)
        try:
            again = designed_observer(plant, sample_time=sample_time, grid=grid, **chosen)
        except TableTooLargeError as error:
            raise _refused(flash, current.code or 0, error) from None
        # The kind is decided: a coarser table does not change which one errs least over the spread.
        again = replace(again, reason=designed.reason, expected=designed.expected)
        current = _sized(again, part_of(again.model), real, needed=True)
        if (current.code or 0) + current.tables <= flash:
            return current
    raise ValueRangeError(
        f"flash of {flash} B", f"was not met within {ATTEMPTS} attempts",
        next_step=f"allow {(current.code or 0) + current.tables} B",
    )  # fmt: skip


def controller_size(controller: FlatModel, real: str, flash: int | None) -> tuple[str, ...]:
    """Return what is to be known of the size of a controller."""
    size = _measured(controller, real, needed=flash is not None)
    if size is None:
        return ("the flash of the code was not measured: no compiler",)
    if flash is not None and size > flash:
        raise ValueRangeError(
            f"flash of {flash} B", f"the code of the controller takes {size} B on a Cortex-M4F",
            next_step=f"allow {size} B, or take another --law or --real float",
        )  # fmt: skip
    return (f"flash on a Cortex-M4F: {size} B, without the C library",)


def _refused(flash: int, code: int, error: TableTooLargeError) -> ValueRangeError:
    least = code + error.least
    return ValueRangeError(
        f"flash of {flash} B",
        f"cannot be met beside {code} B of code: {error.words}; the smallest found that keeps this has "
        f"{least} B",
        next_step=f"allow {least} B, a larger --table-error, or take another --kind or --real float",
    )


def _grid(plant: FlatModel, error: float | None, each: int, most: int | None) -> GridByTorqueError:
    from ..feedback.observer.scheduling.scheduled import whole_contour

    return replace(whole_contour(plant), torque_error=error, bytes_per_number=each, most_bytes=most)


def _sized(designed: DesignedObserver, exported: FlatModel, real: str, *, needed: bool) -> SizedObserver:
    tables = designed.design.compact.size(4 if real == "float" else 8)
    whole = _measured(exported, real, needed=needed)
    return SizedObserver(designed, None if whole is None else whole - tables, tables)


def _measured(exported: FlatModel, real: str, *, needed: bool) -> int | None:
    """Return the flash of code and tables in bytes."""
    from ..export import export_c
    from ..export.compilation.processors import CORTEX_M4F
    from ..export.compilation.target_build import controller_sizes

    with tempfile.TemporaryDirectory() as folder:
        source = export_c(exported, Path(folder), real=real, name="part")
        try:
            return controller_sizes(source, CORTEX_M4F, Path(folder))[1].flash
        except ExportError:
            # Without the wheel of the compiler C is still written; only a budget cannot be judged.
            if needed:
                raise
            return None
