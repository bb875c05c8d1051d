"""Which effect: hypotheses, their fits, the excess over the noise, and the search with its one decision rule.

``screening``, ``reporting`` and ``diagnose`` may import it; it builds on ``blocks`` and ``effects``.
It never reads a file and never writes a text for people.
"""
