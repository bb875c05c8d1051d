"""Instructions of one observer step: generated C against C written by hand, counted by callgrind.

The observer has four states, two measured quantities and one table over the angle. Both are compiled by the
same compiler with the same flags and fed the same inputs; their outputs and status words must agree. Guards
(a reading that can be true or what is expected, a command within its range, states and outputs finite) are in
both or in neither; their cost is the difference between the lines.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np

from benchmarks._tools import run_tool
from nlsdesign.export import export_c
from nlsdesign.export.c.writer import CSource
from nlsdesign.export.compilation.cross_compiler import BASELINE, compiler
from nlsdesign.model.flat import FlatModel, Plausibility, Variable
from tests.hand_built import observer

HERE = Path(__file__).parent
STEPS = 2000
TARGET = 1.1


def model() -> FlatModel:
    """The observer of the tests with the laws of the cam in the table too: no function of libm is left."""
    base = observer()
    (table,) = base.tables
    grid = np.array([table.lower + table.step * k for k in range(table.values.shape[0])])
    extension = 0.015 * 0.2 * np.log(np.cosh(grid / 0.2))
    laws = [extension, 0.015 * np.tanh(grid / 0.2), 9e3 * extension * (1 + 60.0 * extension)]
    names = ("extension", "lever_arm", "force")
    columns = (*table.columns, *(Variable(n, "1", "Law of the cam and rubber at rest") for n in names))
    wide = replace(table, columns=columns, values=np.column_stack([table.values, *laws]))

    x, u, scale, w = ca.SX.sym("x", 4), ca.SX.sym("u", 2), ca.SX.sym("scale"), ca.SX.sym("w", 31)
    innovation = scale * ca.vertcat(w[28] - x[1], u[0] - x[2])
    f = ca.reshape(w[:16], 4, 4).T @ x + w[16:20] * u[1] + ca.reshape(w[20:28], 2, 4).T @ innovation
    y = ca.vertcat(2 * w[29] * (x[0] + w[30]), x[3])
    equations = ca.Function("e", [ca.SX.sym("t"), x, u, scale, w], [f, y, ca.SX(0, 1), ca.SX(0, 1)])
    angle, current = base.inputs
    can = Plausibility(25.0, 1.5e-3, 0.05, moved_by="motor.current", noticeable=0.5)
    return replace(
        base,
        name="generated",
        inputs=(replace(angle, plausibility=can), current),
        tables=(wide,),
        parameters=base.parameters[:1],
        signals=(),
        equations=equations,
    )


def drivers(source: CSource) -> dict[str, str]:
    """One main program for each side; the inputs visit the whole table, BAD ones every guard of a reading."""
    shared = f"""
        #include <math.h>
        #include <stdio.h>
        static double angle(int k)
        {{
            const double true_angle = 1.2 * sin(0.01 * (k / 300 == 5 ? 1500 : k));
            return !BAD ? true_angle : k % 97 == 0 ? NAN : k % 89 == 0 ? 7.0 : k % 53 < 2 ? true_angle - 0.2
                : true_angle + (k % 400 > 380 ? 0.2 : 0.0);
        }}
        static double current(int k)
        {{
            return BAD && k % 101 == 0 ? NAN : BAD && k % 103 == 0 ? -30.0 : 5.0 * cos(0.013 * k);
        }}
        int main(void) {{
            double y[2], sum = 0.0;
            unsigned word = 0u, words = 0u;
            START
            for (int k = 0; k < {STEPS}; ++k) {{
                STEP
                sum += y[0] + 0.01 * y[1];
                words = 31u * words + GUARDED * word;
            }}
            (void)printf("%.17g %u\\n", sum, words);
            return 0;
        }}
    """
    by_hand = "const double u[2] = {angle(k), current(k)}; word = by_hand_step(&state, u, y);"
    generated = (
        "generated_inputs u; generated_outputs o; u.motor.angle = angle(k); u.motor.current = current(k);"
        "word = generated_step(&state, &u, &o); y[0] = o.spring.torque; y[1] = o.motor.speed;"
    )
    return {
        "by_hand": '#include "observer_by_hand.h"'
        + shared.replace("START", "by_hand_state state; by_hand_init(&state);").replace("STEP", by_hand),
        "generated": f'#include "{source.header.name}"'
        + shared.replace("START", "generated_state state; (void)generated_init(&state, 0);").replace(
            "STEP", generated
        ),
    }


def without_guards(text: str) -> str:
    """The generated source with every guard taken out."""
    taken = r"(?:usable|\(void\) plausible)\((inputs->[\w.]+), .*?, &(state->inputs[\w.]+), 0x.*\);"
    text, inputs = re.subn(taken, r"\2 = \1;", text)
    text, begins = re.subn(r" && state->readings\[0\]\.seen != 0u", "", text)
    text, checks = re.subn(r"if \(\(.* >= 0\.0\) \{", "if (1) {", text)
    assert (inputs, begins, checks) == (2, 1, 2)
    return re.sub(
        r"/\* Keeps one command.*?\n}\n|static const reading_limits .*?\n}\n", "", text, flags=re.DOTALL
    )


def prepare(folder: Path) -> None:
    """Write all sources."""
    flat = model()
    source = export_c(flat, folder, name="generated")
    (folder / "generated_bare.c").write_text(without_guards(source.source.read_text()))
    for name in ("observer_by_hand.c", "observer_by_hand.h"):
        shutil.copy(HERE / name, folder)
    rows = ",\n".join("{" + ", ".join(repr(float(v)) for v in row) + "}" for row in flat.tables[0].values)
    (folder / "observer_table.h").write_text("{" + rows + "}\n")
    for name, text in drivers(source).items():
        (folder / f"main_{name}.c").write_text(text)


def compiled(folder: Path, command: list[str], side: str, *, guarded: bool) -> Path:
    """Return a program that prints the sum of the outputs and what the status words come to."""
    step_file = {
        ("by_hand", True): "observer_by_hand.c",
        ("by_hand", False): "observer_by_hand.c",
        ("generated", True): "generated.c",
        ("generated", False): "generated_bare.c",
    }[side, guarded]
    program = folder / "program"
    flags = ["-std=c99", "-ffp-contract=off", f"-DGUARDED={int(guarded)}", f"-DBAD={int(guarded)}"]
    files = [str(folder / f"main_{side}.c"), str(folder / step_file)]
    run_tool([*command, *flags, *files, "-lm", "-o", str(program)], folder)
    return program


def instructions(folder: Path, command: list[str], side: str, *, guarded: bool) -> tuple[float, float, str]:
    """Return instructions per step, the sum of the outputs and what the status words come to."""
    program = compiled(folder, command, side, guarded=guarded)
    report = run_tool(
        [
            "valgrind",
            "--tool=callgrind",
            f"--toggle-collect={side}_step",
            f"--callgrind-out-file={folder / 'out'}",
            str(program),
        ],
        folder,
    )
    collected = re.search(r"Collected : (\d+)", report.stderr)
    assert collected is not None, report.stderr
    total, words = report.stdout.split()
    return int(collected[1]) / STEPS, float(total), words


def compilers() -> dict[str, list[str]]:
    """Commands that compile for any processor of this kind: valgrind lacks the newest instructions."""
    found = {"zig cc": [*compiler(), *BASELINE]}
    if shutil.which("gcc"):
        found["gcc"] = ["gcc"]
    return found


def main() -> int:
    """Print the table; return 1 if a ratio misses the target."""
    if shutil.which("valgrind") is None:
        print("observer step: not measured, valgrind is not installed")
        return 0
    missed = False
    print("observer step, 4 states, one table of 61 x 31: instructions per step by callgrind")
    print(f"{'compiler':14}{'guards':>8}{'by hand':>10}{'generated':>11}{'ratio':>8}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)
        for label, command in compilers().items():
            for optimised in ("-O2", "-O3"):
                both = {}
                for guarded in (True, False):
                    counts, words = {}, {}
                    for side in ("by_hand", "generated"):
                        counts[side], both[side], words[side] = instructions(
                            folder, [*command, optimised], side, guarded=guarded
                        )
                    off = abs(both["by_hand"] - both["generated"]) > 1e-9 * abs(both["by_hand"])
                    if off or words["by_hand"] != words["generated"]:
                        raise SystemExit(f"the outputs differ: {both}")
                    ratio = counts["generated"] / counts["by_hand"]
                    missed |= ratio > TARGET
                    print(
                        f"{label + ' ' + optimised:14}{'yes' if guarded else 'no':>8}"
                        f"{counts['by_hand']:10.1f}{counts['generated']:11.1f}{ratio:8.3f}"
                    )
    print(f"target: ratio at most {TARGET}: {'missed' if missed else 'met'}")
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
