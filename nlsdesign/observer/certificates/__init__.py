"""What is proved of an observer: gains and Lyapunov functions from matrix inequalities, files of proof.

``spread`` and the rooms above may import it; it builds on ``scheduling``.
It never trusts the solver: what is written is checked in exact or interval arithmetic.
"""
