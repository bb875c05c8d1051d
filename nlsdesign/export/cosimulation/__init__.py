"""FMUs run together: one instance, the master algorithm, wires by name, and systems as SSP archives.

Everything outside ``export`` may import it.
It never knows how an FMU was made.
"""
