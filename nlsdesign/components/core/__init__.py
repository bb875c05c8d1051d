"""What every part is: numbers with units, the algebra of one-port elements, the laws of Hooke and Newton.

Everything above may import it: ``Part``, ``Element``, ``Domain``, ``parallel``, ``series``, ``tie``.
It never names a particular material, machine or sensor.
"""
