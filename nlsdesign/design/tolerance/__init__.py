"""What the spreads of the declared numbers do to the torque curve, and what to do about it.

May be imported by the optimisation. Never changes a design.
"""
