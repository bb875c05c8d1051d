"""Bench records: from files through a mapping of columns and checks of quality to signals on one clock.

``discrepancy`` and the inner rooms that fit may import it; it builds on ``filters`` and ``residuals``.
It never fits anything.
"""
