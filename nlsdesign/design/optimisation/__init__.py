"""The joint design: unknowns, goals, limits, starts, conflicts and the result.

May be imported by the front of ``design`` only. Never reads or writes files.
"""
