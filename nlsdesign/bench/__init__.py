"""What measured records say of a model: fits, the missing effect, and calibration.

Three rooms on three floors: ``identification``, ``discrepancy``, ``calibration``.
"""
