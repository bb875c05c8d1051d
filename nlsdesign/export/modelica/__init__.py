"""Modelica: the equations of a continuous model as plain text.

Everything outside ``export`` may import it; it builds on ``c`` for where a model comes from.
It never runs a Modelica tool.
"""
