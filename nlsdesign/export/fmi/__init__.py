"""Functional mock-up units for FMI 2 and 3: sources, variables, model description, documentation, archive.

Everything outside ``export`` may import it; it builds on ``c`` and ``compilation``.
It never runs an FMU.
"""
