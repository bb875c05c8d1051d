"""Analysis over the cam angle, observers of the torque, and the controllers that act on their estimate.

Three rooms on three floors: ``analysis``, ``observer``, ``control``. Each may import those before it. Sweeps,
figures, commands and the live page may import all three. None of them knows how a model is exported.

Where a margin goes:

- of the plant alone, at an angle (poles, what is seen, the best estimate): ``analysis``;
- of an observer, over the numbers that the deck does not know exactly: ``observer.spread``;
- of a closed loop (gain, phase, delay, coupled loads, onset of limit cycling): ``control.evaluation``.
"""
