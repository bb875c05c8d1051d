"""Target curves, and how they are read or follow from a task.

May be imported by all of ``design``. Never knows a cam.
"""
