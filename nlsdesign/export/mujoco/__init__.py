"""MuJoCo: a plant as MJCF, with an engine plug-in in C and a Python callback for its laws.

Everything outside ``export`` may import it; it builds on ``c``. It never runs MuJoCo or a compiler.
"""
