"""What people look at: figures and pages. Nothing here computes a result.

Three rooms on three floors: ``figures``, ``report``, ``sweep_report``.
"""
