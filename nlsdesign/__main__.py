"""``python -m nlsdesign`` and ``nlsdesign`` are the command line; interrupts are handled from here on."""

from __future__ import annotations

import gc

from .foundation.processes import guarded, use_one_thread


def main() -> None:
    """Run the command line, whose modules are imported where an interrupt is handled already."""
    guarded(_run)


def _run() -> None:
    use_one_thread()
    # Modules and models are no garbage; to look for it after every 700 new objects takes a twentieth of all.
    gc.set_threshold(50_000, 20, 20)
    from .cli import main as program

    program()


if __name__ == "__main__":
    main()
