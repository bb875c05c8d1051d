"""Plant, observer and controller wired by name and simulated in one piece.

``evaluation`` and ``tuning`` may import it; it builds on ``laws``.
It never judges what it simulated.
"""
