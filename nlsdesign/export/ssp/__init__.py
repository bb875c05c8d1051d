"""System structure and parameterisation: a co-simulated system as one archive, written and read.

Everything outside ``export`` may import it; it builds on ``cosimulation`` and ``fmi``.
It never steps an FMU itself.
"""
