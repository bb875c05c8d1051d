"""Observers that are scheduled over one measured angle: forms, gain rules, the step and its table.

The other inner rooms of ``observer`` and all rooms above may import it.
It never asks how good an observer is.
"""
