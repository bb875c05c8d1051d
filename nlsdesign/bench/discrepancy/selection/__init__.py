"""Which effect: hypotheses, their fits, the excess over the noise, and the search with its one rule.

``screening``, ``planning``, ``reporting`` and ``diagnose`` may import it; it builds on ``tearing``,
``fitting`` and ``effects``. It never reads a file and never writes a text for people.
"""
