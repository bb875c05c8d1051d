"""The default observer: a cascade whose torque is corrected by what the balance of the driven body shows.

``spread`` and the rooms above may import it; it builds on ``scheduling``. It never measures its own error.
"""
