"""Observers that learn what the deck does not know exactly, and the best that any estimator could do.

``certificates``, ``spread`` and the rooms above may import it; it builds on ``scheduling``.
It never measures its own error.
"""
