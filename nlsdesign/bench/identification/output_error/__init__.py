"""Fits of whole models by simulation: windows, multiple shooting, CMA-ES, prediction.

``discrepancy`` may import it; it builds on all other inner rooms.
It never changes the structure of a model.
"""
