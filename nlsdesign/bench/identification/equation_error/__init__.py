"""Blocks of a model driven by measured signals: their response with exact derivatives, their residuals.

``least_squares``, ``windowed_simulation`` and ``discrepancy`` may import it; it builds on ``records``.
It never decides which block there is, nor moves a number.
"""
