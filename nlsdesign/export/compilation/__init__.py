"""The C cross-compiler, and generated C run from Python.

``fmi`` and everything outside ``export`` may import it; it builds on ``c``.
It never writes C of its own.
"""
