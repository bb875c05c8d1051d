"""``python -m nlsdesign`` is the command line."""

from .cli import main

main()
