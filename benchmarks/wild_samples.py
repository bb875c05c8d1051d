"""Samples with wild inputs for every kind of code in float: ``python -m benchmarks.wild_samples 100000``.

Each kind is compiled by the compiler of this machine (``cc``, with its undefined-behaviour sanitizer) and
called with bursts of wild samples, a second of clean ones behind each: not a number, infinities, any finite
number, jumps, ends of ranges, readings that stand, and time stamps that are late, repeated, stale or run
over. Beside it runs a twin that sees the clean samples alone: estimates that are apart after the second are
counted. Prints a table; exit status 1 if an output was not finite or a current beyond its range.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks._generated import every_kind, written
from nlsdesign.export import CSource
from nlsdesign.model import FlatModel

PROGRAM = """#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include "@name@.h"
#define INPUTS @inputs@
#define OUTPUTS @outputs@
#define TORQUE @torque@ /* which output is the estimate, -1 if none */
static uint64_t random_word = 0x9e3779b97f4a7c15u;
static double uniform(void)
{
    random_word ^= random_word << 13; random_word ^= random_word >> 7; random_word ^= random_word << 17;
    return (double)(random_word >> 11) * 0x1p-53;
}
static float wild(float good, float before)
{
    switch ((int)(uniform() * 8.0)) {
    case 0: return NAN;
    case 1: return uniform() < 0.5 ? INFINITY : -INFINITY;
    case 2: return (float)((uniform() < 0.5 ? 1.0 : -1.0) * pow(10.0, -45.0 + 83.0 * uniform()));
    case 3: return good + (float)(6.0 * uniform() - 3.0);
    case 4: return uniform() < 0.5 ? 1.5f : -1.5f;
    case 5: return before;
    case 6: return -0.0f;
    default: return good;
    }
}
static const float lowest[OUTPUTS] = {@lowest@}, highest[OUTPUTS] = {@highest@};
int main(int argc, char **argv)
{
    static @name@_state state, twin;
    @clock@
    const long samples = atol(argv[argc - 1]);
    long given = 0, flagged = 0, not_finite = 0, beyond = 0, bursts = 0, apart = 0;
    uint32_t now = 0xfffff000u;
    (void)@name@_init(&state, NULL);
    (void)@name@_init(&twin, NULL);
    for (long k = 0; given < samples; ++k) {
        const double time = 1e-3 * (double)k;
        const int is_wild = k % 1500 < 500;
        @name@_inputs clean, seen;
        @name@_outputs from, of_twin;
        float *const good[INPUTS] = {@good@}, *const bad[INPUTS] = {@bad@};
        static float before[INPUTS];
        for (int i = 0; i < INPUTS; ++i) {
            *good[i] = (float)((i == 0 ? 0.4 : 1.0) * sin(9.0 * time) + 0.1 * sin(31.0 * time));
            *bad[i] = is_wild ? wild(*good[i], before[i]) : *good[i];
            before[i] = *bad[i];
        }
        given += is_wild;
        now += 1000u;
        const uint32_t stamp = is_wild ? (uint32_t)(uniform() * 4.0) : 3u;
        const uint32_t late = now + (uint32_t)(uniform() * 1e6);
        const uint32_t stamps[4] = {now - 900u, late, (uint32_t)random_word, now};
        (void)stamp;
        (void)stamps;
        const uint32_t word = @step@;
        (void)@name@_step(&twin, &clean, &of_twin);
        flagged += is_wild && word != 0u;
        const float *const out[OUTPUTS] = {@out@}, *const other[OUTPUTS] = {@other@};
        double worst = 0.0;
        for (int i = 0; i < OUTPUTS; ++i) {
            not_finite += !isfinite(*out[i]);
            beyond += *out[i] < lowest[i] || *out[i] > highest[i];
            worst = i == TORQUE ? fabs((double)*out[i] - (double)*other[i]) : worst;
        }
        if (k % 1500 == 1499) {
            ++bursts;
            apart += worst > 0.05;
        }
    }
    (void)printf("%ld %ld %ld %ld %ld %ld\\n", given, flagged, not_finite, beyond, bursts, apart);
    return 0;
}
"""


def program(source: CSource, model: FlatModel) -> str:
    """Return the program that calls a step so."""
    paths, timed = source.writer.paths, source.name == "step"
    names = [v.name for v in model.outputs]
    judged = [i for i, name in enumerate(names) if name in ("spring.torque", "motor.current")]
    outputs = judged or list(range(len(names)))
    timed_step = f"{source.name}_step_at(&clock, &state, &seen, &from, stamps[stamp])"
    values = {
        "torque": next((k for k, i in enumerate(outputs) if names[i] == "spring.torque"), -1),
        "name": source.name, "inputs": len(paths.inputs), "outputs": len(outputs),
        "good": ", ".join(f"&clean.{p}" for p in paths.inputs),
        "bad": ", ".join(f"&seen.{p}" for p in paths.inputs),
        "out": ", ".join(f"&from.{paths.outputs[i]}" for i in outputs),
        "other": ", ".join(f"&of_twin.{paths.outputs[i]}" for i in outputs),
        "lowest": ", ".join(_limit(model.outputs[i].minimum, "-INFINITY") for i in outputs),
        "highest": ", ".join(_limit(model.outputs[i].maximum, "INFINITY") for i in outputs),
        "clock": f"static {source.name}_clock clock;" if timed else "",
        "step": timed_step if timed else f"{source.name}_step(&state, &seen, &from)",
    }  # fmt: skip
    text = PROGRAM
    for key, value in values.items():
        text = text.replace(f"@{key}@", str(value))
    return text


def _limit(value: float | None, none: str) -> str:
    return none if value is None or abs(value) == float("inf") else f"{value!r}f"


def counted(name: str, model: FlatModel, samples: int) -> list[int]:
    """Return samples, those with a flag, outputs that are not finite or beyond, bursts, and those after which
    an estimate stays off by more than 1 % of 5 N·m."""
    with tempfile.TemporaryDirectory() as folder:
        source = written(name, model, Path(folder), "float", quick_monitor=False)
        (Path(folder) / "main.c").write_text(program(source, source.model), encoding="utf-8")
        flags = ["-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno"]
        flags += ["-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
        files = [str(Path(folder) / "main.c"), str(source.source)]
        subprocess.run(["cc", *flags, "-I", folder, *files, "-lm", "-o", f"{folder}/wild"], check=True)
        done = subprocess.run([f"{folder}/wild", str(samples)], capture_output=True, text=True, check=True)
    return [int(n) for n in done.stdout.split()]


def main() -> int:
    """Count, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("samples", type=int, help="wild samples of each kind")
    given, wrong = parser.parse_args(), 0
    print("| | wild samples | flagged | not finite | beyond the range | bursts | not forgotten |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name, model in every_kind().items():
        row = counted(name, model, given.samples)
        wrong += row[2] + row[3]
        print(f"| {name} | {' | '.join(f'{n:,}' for n in row)} |", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
