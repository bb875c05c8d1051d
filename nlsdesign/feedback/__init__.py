"""Analysis over the cam angle, observers of the torque, and the controllers that act on their estimate.

Three rooms on three floors: ``analysis``, ``observer``, ``control``. None knows how a model is exported.
"""
