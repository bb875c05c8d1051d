"""Code whose numbers are replaced at run time: designed for one deck, and again for others in the same form.

A design chooses grid points and what is tabulated by what its deck needs. Another deck is designed over the
points of the code, with the same entries in the same columns, so that only numbers differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..components import Assembly, declare
from ..feedback.control import joined
from ..feedback.observer import Grid, designed_observer
from ..feedback.observer.scheduling.table import ColumnPlace, Compact, Draft, Entries, FineEntries
from ..feedback.observer.scheduling.torque_grid import MOST_SHARE, RESOLUTION, TableTrial
from ..foundation.deck import read_deck
from ..foundation.errors import ExportError
from ..foundation.quantity import typeset_unit
from ..foundation.written_numbers import prefixed
from ..model import FlatModel, Variable, flatten

if TYPE_CHECKING:
    from ..export import LoadableModel, ParameterBlock

MOVED = 5e-3
"""Largest share by which the numbers of a deck are moved to see what follows from them."""
Controller = Callable[[FlatModel], FlatModel]
"""Designs the torque controller of a plant."""


@dataclass(frozen=True, eq=False)
class SameTable(Grid):
    """The grid points of a table, and which entries stand in which column, for designs of other decks.

    Parameters
    ----------
    angles
        Grid points in rad, shape (n,).
    columns
        Keys of the entries that are columns.
    places
        By key of each entry the column that it is read from, −1 for a constant, −2 for nothing.
    uniform
        Whether the points lie equally far apart.
    judged
        Whether the torque error of a table over these points is measured, which takes the most time.
    """

    angles: tuple[float, ...]
    columns: tuple[str, ...]
    places: Mapping[str, int]
    uniform: bool
    judged: bool = True

    @property
    def lower(self) -> float:  # type: ignore[override]
        """The first point."""
        return self.angles[0]

    @property
    def upper(self) -> float:  # type: ignore[override]
        """The last point."""
        return self.angles[-1]

    @staticmethod
    def of(table: Compact) -> SameTable:
        """Return what a designed table has in common with those of other decks.

        Parameters
        ----------
        table
            Of the exported observer.
        """
        places = {
            key: place.column if place.column is not None else -1 if place.factor else -2
            for key, place in table.places.items()
        }
        return SameTable(
            tuple(table.angles.tolist()), tuple(c.key for c in table.columns), places, table.uniform
        )

    def compact(self, entries: Entries, draft: Draft | None = None) -> Compact:
        """Return the table over these points; see :class:`~nlsdesign.feedback.observer.Grid`.

        Parameters
        ----------
        entries
            Of the step, as functions of the angle.
        draft
            The observer, with which the torque error of the table is measured.

        Raises
        ------
        ExportError
            If there are other entries, or the table moves the torque by more than 2 % of the largest.
        """
        fine = FineEntries.of(entries, self.lower, self.upper, RESOLUTION)
        known, grid = {e.key: e for e in fine.entries}, np.array(self.angles)
        if known.keys() != self.places.keys():
            raise ExportError(
                "table of the observer", "has other entries than that of the code",
                next_step="export the code again from the other deck",
            )  # fmt: skip
        columns = tuple(known[key] for key in self.columns)
        places: dict[str, ColumnPlace] = {}
        for key, column in self.places.items():
            values = known[key].values
            if column < 0:
                places[key] = ColumnPlace(float((values.max() + values.min()) / 2) if column == -1 else 0.0)
                continue
            shared = columns[column].values
            factor = 1.0 if key == self.columns[column] else float(values @ shared / (shared @ shared))
            places[key] = ColumnPlace(factor, column)
        values = np.array([e.values for e in entries(grid) if e.key in set(self.columns)])
        in_order = [key for key in known if key in set(self.columns)]
        rows = [in_order.index(key) for key in self.columns]
        at_points = np.ascontiguousarray(values.reshape(-1, len(grid))[rows].T)
        table = Compact(grid, columns, at_points, places, {}, 0.0, self.uniform)
        if draft is None or not self.judged:
            return table
        return self.with_error(table, TableTrial(draft, fine), draft)

    def with_error(self, table: Compact, trial: TableTrial, draft: Draft) -> Compact:
        """Return a table with its torque error; one that is too large is refused.

        Parameters
        ----------
        table
            Over these points.
        trial
            Compares it with exact functions of the angle.
        draft
            The observer.

        Raises
        ------
        ExportError
            If it moves the torque by more than 2 % of the largest.
        """
        error, unit = trial.error(table), typeset_unit(draft.plant.estimate.unit)
        if not error.share <= MOST_SHARE:
            raise ExportError(
                "table of the observer",
                f"over the points of the code moves the torque by {prefixed(error.largest, unit)}, "
                f"more than {100.0 * MOST_SHARE:g} % of {error.full_scale:.3g} {unit}",
                next_step="export the code again from the other deck",
            )
        return replace(table, torque_error=error)

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        return {
            "angles": list(self.angles), "columns": list(self.columns), "places": dict(self.places),
            "uniform": self.uniform,
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class CodeRecipe:
    """How a code with blocks was designed, so that another deck can be designed alike.

    Parameters
    ----------
    what
        ``"observer"``, ``"controller"`` or ``"both"``.
    kind, sample_time, spring, measured
        As for :func:`~nlsdesign.feedback.observer.designed_observer`.
    table
        Of the observer; ``None`` for a controller alone.
    law
        Options of the controller, for who designs it.
    deck
        Text of the deck of the code.
    """

    what: str
    kind: str | None
    sample_time: float
    spring: str | None
    measured: str | None
    table: SameTable | None
    law: Mapping[str, Any] = field(default_factory=dict)
    deck: str = ""

    def designed(self, plant: FlatModel, controller: Controller) -> FlatModel:
        """Return the observer, the controller or both, for a plant.

        Parameters
        ----------
        plant
            Continuous.
        controller
            Designs the torque controller of a plant.
        """
        if self.what == "controller":
            return controller(plant)
        observer = designed_observer(
            plant, kind=self.kind, sample_time=self.sample_time, spring=self.spring, measured=self.measured,
            grid=self.table,
        ).model  # fmt: skip
        return observer if self.what == "observer" else joined(observer, controller(plant))

    def loadable(self, plant: FlatModel, controller: Controller) -> LoadableModel:
        """Return the model of the code with its coefficients as parameters.

        Parameters
        ----------
        plant, controller
            As for :meth:`designed`.

        Raises
        ------
        ExportError
            If the equations change their form with the numbers.
        """
        from ..export import loadable_model  # here, as its libraries take time to load

        # What the table of the code costs is known, and of the moved numbers nobody asks.
        quick = replace(self, table=self.table and replace(self.table, judged=False))
        try:
            return loadable_model(
                quick.designed(plant, controller), quick.designed(moved_numbers(plant), controller)
            )
        except ExportError as error:
            raise ExportError(
                f"blocks for '{plant.name}'", f"cannot be written: {error.thing} {error.rule}",
                next_step="export without --block, or take another --kind, such as corrected or cascade",
            ) from None  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        names = ("what", "kind", "sample_time", "spring", "measured", "deck")
        table = self.table.to_dict() if self.table else None
        return {name: getattr(self, name) for name in names} | {"table": table, "law": dict(self.law)}

    @staticmethod
    def of(block: ParameterBlock) -> CodeRecipe:
        """Return what the block of a code says of its design.

        Parameters
        ----------
        block
            From the JSON beside the code.

        Raises
        ------
        ExportError
            If it does not say it.
        """
        try:
            given = dict(block.recipe)
            table = given.pop("table")
            if table is not None:
                table = SameTable(
                    tuple(map(float, table["angles"])), tuple(table["columns"]), dict(table["places"]),
                    bool(table["uniform"]),
                )  # fmt: skip
            return CodeRecipe(**given, table=table)
        except (KeyError, TypeError, ValueError) as error:
            raise ExportError(
                f"block of '{block.deck}'", f"does not say how its code was designed: {error!r}",
                next_step="take the NAME_block.json that nlsdesign export c --block has written",
            ) from None  # fmt: skip


def moved_numbers(plant: FlatModel) -> FlatModel:
    """Return a plant whose numbers and spreads are all a little different; one factor for a row of numbers.

    Numbers of pieces, and where the contour of a cam ends, stay: grids end there.
    """
    cams = [cam for spring in plant.springs for cam in spring.cams]
    fixed = {name for cam in cams for name in (cam.elements, cam.last_angle)}
    random, factors = np.random.default_rng(0), dict[str, float]()

    def moved(v: Variable) -> Variable:
        row = v.name.partition("[")[0]
        factor = factors.setdefault(row, 1.0 + MOVED * float(random.uniform(0.2, 1.0)))
        spread = v.spread.times(1.0 + 0.1 * MOVED * len(factors)) if v.spread else v.spread
        start = v.start if v.name in fixed else v.start * factor
        within = v.minimum <= start <= v.maximum
        return replace(v, start=start if within else v.start / factor, spread=spread)

    return replace(plant, parameters=tuple(map(moved, plant.parameters)))


def block_for(code: ParameterBlock, better: Assembly, controller: Controller) -> ParameterBlock:
    """Return the block with which a code computes what it would if it were exported from another deck.

    Parameters
    ----------
    code
        Block from the JSON beside the code, which says how that was designed.
    better
        The other deck, for instance calibrated or diagnosed.
    controller
        Designs the torque controller of a plant, as for the code.

    Raises
    ------
    ExportError
        If the other design has another form or grid, a number is out of its range, or this version designs
        the code in another form than that which wrote it.
    """
    from ..export.c.block_layout import block_layout
    from ..export.c.writer import paths_in_memory

    recipe = CodeRecipe.of(code)
    declared = declare(read_deck(recipe.deck, Path(f"{code.layout.deck}.toml")))
    loadable = recipe.loadable(flatten(declared), controller)
    names = tuple(v.name for v in loadable.parameters)
    again = block_layout(loadable, code.layout.name, code.layout.real, paths_in_memory)
    if again.digest != code.layout.digest:
        raise ExportError(
            f"code '{code.layout.name}' of deck '{code.layout.deck}'",
            "was written by a version that designs it in another form",
            next_step="export the code again",
        )
    model = recipe.designed(flatten(better), controller)
    made = code.layout.block(loadable.numbers_of(model), names, model)
    return replace(made, recipe=code.recipe)
