"""Run all benchmarks: ``python -m benchmarks``."""

from __future__ import annotations

import importlib
import sys

NAMES = (
    "observer_step",
    "bench_simulation",
    "bench_events",
    "fit",
    "cam_design",
    "analysis_over_angle",
    "observers",
)


def main() -> int:
    """Run one benchmark after the other; return how many missed their target or could not be measured."""
    failed = 0
    for name in NAMES:
        print(f"== {name}", flush=True)
        try:
            status = importlib.import_module(f"benchmarks.{name}").main()
        except SystemExit as end:
            # One that cannot be measured here says why and must not keep the others from running.
            print(end, flush=True)
            status = 1
        failed += bool(status)
    return failed


if __name__ == "__main__":
    sys.exit(main())
