"""Blocks of a model driven by measured signals: their response with exact derivatives, their residuals.

``estimation``, ``output_error`` and ``discrepancy`` may import it; it builds on the rooms below.
It never decides which block there is, nor moves a number.
"""
