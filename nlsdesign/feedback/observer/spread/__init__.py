"""The error of observers over the spread of the deck, and the choice between observers by it.

The front of ``observer`` and the rooms above may import it; it builds on all other inner rooms.
It never changes what an observer computes.
"""
