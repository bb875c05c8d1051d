"""The command line: each command takes a deck, writes into ``--out``, prints a short table."""

from .main import main

__all__ = ["main"]
