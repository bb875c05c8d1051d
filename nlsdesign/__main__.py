"""``python -m nlsdesign`` and ``nlsdesign`` are the command line; interrupts are handled from here on."""

from __future__ import annotations

from .foundation.processes import guarded, use_one_thread


def main() -> None:
    """Run the command line, whose modules are imported where an interrupt is handled already."""
    guarded(_run)


def _run() -> None:
    use_one_thread()
    from .cli import main as program

    program()


if __name__ == "__main__":
    main()
