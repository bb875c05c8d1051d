"""FMUs run together: one instance, the master algorithm, wires by name.

Everything outside ``export`` may import it.
It never knows how an FMU was made.
"""
