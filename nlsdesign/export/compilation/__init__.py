"""The C cross-compiler, generated C run from Python, and generated C on the processor of a controller.

``fmi`` and everything outside ``export`` may import it; it builds on ``c``.
It never changes the code that it compiles, runs or measures.
"""
