"""Generated C on the processor of a controller: cross-compilation, sizes, instructions, run in an emulator.

``ssp`` and everything outside ``export`` may import it; it builds on ``compilation`` and ``c``.
It never changes the code that it measures.
"""
