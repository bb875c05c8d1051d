"""Controllers as discrete flat models.

``loop`` and the rooms above it may import it.
It never simulates a loop.
"""
