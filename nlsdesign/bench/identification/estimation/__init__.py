"""Numbers from residuals: parameters, priors, bounded least squares, profiles, covariance in words.

``output_error`` and ``discrepancy`` may import it; it builds on the rooms below.
It never integrates a whole model.
"""
