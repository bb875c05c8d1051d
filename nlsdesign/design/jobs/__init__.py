"""Design files: what is asked of a design, written beside the deck.

May be imported by the front of ``design``. Never designs.
"""
