"""Signs that the records are at fault, seen beside any hypothesis: causality, scale, another rig.

``reporting`` and ``diagnose`` may import it; it builds on ``selection``.
It never names an effect.
"""
