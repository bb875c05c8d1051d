"""Run all benchmarks: ``python -m benchmarks``."""

from __future__ import annotations

import importlib

NAMES = (
    "observer_step",
    "bench_simulation",
    "bench_events",
    "fit",
    "cam_design",
    "analysis_over_angle",
    "observers",
)


def main() -> None:
    """Run one benchmark after the other."""
    for name in NAMES:
        print(f"== {name}", flush=True)
        importlib.import_module(f"benchmarks.{name}").main()


if __name__ == "__main__":
    main()
