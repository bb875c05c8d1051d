"""A model cut at its measured signals into blocks that measurements alone drive, and what they predict.

Every other inner room may import it.
It never knows an effect.
"""
