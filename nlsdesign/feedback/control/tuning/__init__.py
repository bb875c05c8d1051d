"""Gains of a torque loop, chosen under margins and limits.

The front of ``control`` and the rooms above may import it; it builds on ``evaluation``.
It never simulates by itself.
"""
