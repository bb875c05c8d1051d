"""No float, NaN and infinities included, leads a look-up out of its table: tried one by one."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from nlsdesign.export.c.c_text import Real
from nlsdesign.export.c.table_lookup import c_tables, look_up
from nlsdesign.model.flat import Table, Variable
from tests.compiling import compile_program
from tests.unit.export.test_c import looked_up

COLUMNS = (Variable("a", "1", "Looked up"),)
# A conversion of a number that int32_t cannot hold, and an index beyond an array, end the program: by a trap,
# for the library that would say where takes half a minute to build.
CHECKED = (
    "-std=c99",
    "-Wno-unused",
    "-fsanitize=float-cast-overflow,bounds,undefined",
    "-fsanitize-trap=float-cast-overflow,bounds,undefined",
)
SPACINGS = {
    "even": np.full(60, 0.02),
    "crowded at one end": np.geomspace(1e-4, 0.3, 60),
    "crowded in the middle": np.r_[np.geomspace(0.3, 1e-3, 60), np.geomspace(1e-3, 0.3, 60)],
    "many": np.random.default_rng(2).uniform(1e-3, 0.02, 600),
}


def program(spacing: str, folder: Path, spoil=lambda text: text) -> Path:
    """A look-up by breakpoints, or of a uniform grid, as it is generated."""
    points = np.r_[-1.1344640137963142, -1.1344640137963142 + np.cumsum(SPACINGS[spacing])]
    if spacing == "even":
        table = Table("u", float(points[0]), 0.02, COLUMNS, np.arange(61.0)[:, None])
    else:
        table = Table.over("u", points, COLUMNS, np.arange(float(len(points)))[:, None])
    model = looked_up(table)
    tables = c_tables(model, Real.FLOAT)
    data = tables[0].data()
    statements = look_up(tables, {"u": "u"}, {0})
    (folder / "table.c").write_text("\n".join(data))
    (folder / "statements.c").write_text(spoil("\n".join(statements)) + "\n")
    macros = [f"-DCELLS={len(points) - 1}", "-DLEFT=left_0", "-DSHARE=share_0"]
    if spacing != "even":
        macros.append("-DPOINTS=breakpoints_0")
    text = (Path(__file__).parents[2] / "look_up.c").read_text()
    (folder / "look_up.c").write_text(text)
    return compile_program([folder / "look_up.c"], folder / "look_up", flags=[*CHECKED, *macros])


@pytest.mark.long_cases("even", "crowded at one end", "crowded in the middle")
@pytest.mark.parametrize("spacing", SPACINGS)
def test_sampled_floats_find_their_cell_and_no_index_leaves_the_table(spacing, tmp_path):
    done = subprocess.run([program(spacing, tmp_path), "100003"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("spacing", SPACINGS)
def test_all_floats_find_their_cell_and_no_index_leaves_the_table(spacing, tmp_path):
    done = subprocess.run([program(spacing, tmp_path), "1"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


def test_an_index_beyond_the_table_is_noticed(tmp_path):
    done = subprocess.run(
        [
            program("many", tmp_path, lambda text: text.replace("place_0 = above_0 < ", "place_0 = 9.0f < ")),
            "100003",
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode != 0
