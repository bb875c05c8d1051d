"""Counts what there is to read: lines, names, helpers, repetitions, and the walks of a value.

``python -m tests.house`` prints all figures with their definitions, ``--room NAME`` the places behind them,
``--walks`` the way of a parameter through the calls; ``--budget`` writes figures that fell into the budget.
"""
