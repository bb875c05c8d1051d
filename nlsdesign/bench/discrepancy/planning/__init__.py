"""What to measure next: experiments within the limits of a machine, and which tells hypotheses apart.

``reporting`` and ``diagnose`` may import it; it builds on ``selection`` and ``tearing``.
It never reads a record from a file, fits nothing and decides no verdict.
"""
