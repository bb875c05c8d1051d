"""Observers that keep a size of flash, what that costs in torque, and steps that keep a time."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..feedback.observer import DesignedObserver, GridByTorqueError, designed_observer
from ..feedback.observer.scheduling.scheduled import whole_contour
from ..feedback.observer.scheduling.torque_grid import TableTooLargeError
from ..foundation.errors import ExportError, ValueRangeError
from ..foundation.quantity import typeset_unit
from ..foundation.written_numbers import prefixed
from ..model import FlatModel

if TYPE_CHECKING:
    from ..export import Processor

ATTEMPTS = 3
"""Designs until code and table together keep a size; a coarser table changes the code a little."""


@dataclass(frozen=True, eq=False)
class SizedObserver:
    """An observer and what it takes."""

    designed: DesignedObserver
    code: int | None  # flash of the code in bytes, without tables; None where no compiler is installed
    tables: int  # flash of the tables in bytes
    processor: Processor  # for which it was measured

    @property
    def flash(self) -> int:
        """Code and tables in bytes; the tables alone where the code was not measured."""
        return (self.code or 0) + self.tables

    def findings(self) -> tuple[str, ...]:
        """Return in sentences what the table costs, and how large everything is."""
        compact, unit = self.designed.design.compact, typeset_unit(self.designed.design.model.outputs[0].unit)
        kind = "uniform" if compact.uniform else "by breakpoints"
        error = compact.torque_error
        table = f"table: {len(compact.angles)} angles {kind}, {len(compact.columns)} columns"
        if error is not None:
            table += (
                f"; it moves the torque by at most {prefixed(error.largest, unit)}, "
                f"{prefixed(error.rms, unit, digits=2)} rms, of {error.full_scale:.3g} {unit} "
                f"({100.0 * error.share:.2g} %)"
            )
        if self.code is None:
            return table, f"flash of the tables: {self.tables} B; the code was not measured: no compiler"
        total = f"flash on a {self.processor.name}: {self.flash} B"
        return table, f"{total} ({self.code} B code with what it calls, {self.tables} B tables)"


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

    Parameters
    ----------
    plant
        Continuous flat model.
    sample_time
        In s.
    real
        Type of the numbers in C, ``"float"`` or ``"double"``.
    flash
        Most bytes of code and tables; the table is made coarser for it. ``None`` for any size.
    table_error
        Torque error in N·m that the table may cause; by default 0.02 % of the largest torque.
    part_of
        Makes what is exported of the observer; by default that is the observer alone.
    **chosen
        As for :func:`~nlsdesign.feedback.observer.designed_observer`: kind, spring, measured.

    Raises
    ------
    ValueRangeError
        If no table is that small; the message says which size is possible.
    ExportError
        If a size is asked for and no compiler is installed.
    """
    number, board = 4 if real == "float" else 8, _usual_processor()

    def designed(most: int | None) -> DesignedObserver:
        grid: GridByTorqueError = replace(
            whole_contour(plant), torque_error=table_error, bytes_per_number=number, most_bytes=most
        )
        return designed_observer(plant, sample_time=sample_time, grid=grid, **chosen)

    def measured(observer: DesignedObserver) -> SizedObserver:
        tables = observer.design.compact.size(number)
        whole = measured_flash(part_of(observer.model), real, board, needed=flash is not None)
        return SizedObserver(observer, None if whole is None else whole - tables, tables, board)

    current = measured(designed(None))
    if flash is None or current.code is None or current.flash <= flash:
        return current
    first = current.designed
    chosen = {**chosen, "kind": first.kind}
    for _ in range(ATTEMPTS):
        code = current.code or 0
        if not current.tables:
            raise ValueRangeError(
                f"flash of {flash} B", f"the code alone takes {code} B on a {board.name}",
                next_step=f"allow {code} B, or take another --kind or --real float",
            )  # fmt: skip
        try:
            again = designed(max(flash - code, 1))
        except TableTooLargeError as error:
            least = code + error.least
            raise ValueRangeError(
                f"flash of {flash} B",
                f"cannot be met beside {code} B of code: {error.words}; the smallest found that keeps this "
                f"has {least} B",
                next_step=f"allow {least} B, a larger --table-error, or take another --kind or --real float",
            ) from None
        # The kind is decided: a coarser table does not change which one errs least over the spread.
        current = measured(replace(again, reason=first.reason, expected=first.expected))
        if current.flash <= flash:
            return current
    raise ValueRangeError(
        f"flash of {flash} B", f"was not met within {ATTEMPTS} attempts",
        next_step=f"allow {current.flash} B",
    )  # fmt: skip


def require_flash(controller: FlatModel, real: str, most: int | None = None) -> str:
    """Return in a sentence how much flash a controller without tables takes; refuse one that takes more."""
    board = _usual_processor()
    size = measured_flash(controller, real, board, needed=most is not None)
    if size is None:
        return "the flash of the code was not measured: no compiler"
    if most is not None and size > most:
        raise ValueRangeError(
            f"flash of {most} B", f"the code of the controller takes {size} B on a {board.name}",
            next_step=f"allow {size} B, or take another --law or --real float",
        )  # fmt: skip
    return f"flash on a {board.name}: {size} B, without the C library"


def require_time(exported: FlatModel, real: str, *, share: float, clock: float) -> str:
    """Return in a sentence what a step takes of its sample at a clock in Hz; refuse more than a share."""
    from ..export import export_c, measure_on_target

    board, sample_time = _usual_processor(), exported.sample_time or 1.0
    with tempfile.TemporaryDirectory() as folder:
        cost = measure_on_target(export_c(exported, Path(folder), real=real, name="part"), board)
    if cost.run is None:
        raise ExportError(
            "the budget of time", f"cannot be judged: {cost.reason}", next_step="leave --budget out"
        )
    most = int(cost.run.instructions.max())
    taken = most / (clock * sample_time)
    words = (
        f"{100.0 * taken:.3g} % of a sample of {1e3 * sample_time:g} ms at {1e-6 * clock:g} MHz "
        "if each takes one cycle"
    )
    if taken > share:
        raise ValueRangeError(
            f"budget of {100.0 * share:g} %", f"a step takes {most} instructions on a {board.name}, {words}",
            next_step="allow more, or take another --kind or --real float",
        )  # fmt: skip
    usual = int(np.median(cost.run.instructions))
    return f"instructions on a {board.name}: {usual}, at most {most}, {words}"


def _usual_processor() -> Processor:
    """Return the processor for which the flash is measured by default."""
    from ..export import CORTEX_M4F

    return CORTEX_M4F


def measured_flash(exported: FlatModel, real: str, processor: Processor, *, needed: bool) -> int | None:
    """Return the flash of code and tables in bytes; ``None`` without a compiler, unless it is needed."""
    from ..export import controller_sizes, export_c  # here, as its libraries take time to load

    with tempfile.TemporaryDirectory() as folder:
        source = export_c(exported, Path(folder), real=real, name="part")
        try:
            return controller_sizes(source, processor, Path(folder))[1].flash
        except ExportError:
            # Without the wheel of the compiler C is still written; only a budget cannot be judged.
            if needed:
                raise
            return None
