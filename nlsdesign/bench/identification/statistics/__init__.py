"""What residuals tell: noise floor, effective sample size, filters, losses, metrics, work over a loop.

Every other inner room and ``discrepancy`` may import it; it works on plain arrays.
It never knows a record, a file or a model.
"""
