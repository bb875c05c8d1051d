"""What a closed loop does, measured on simulated runs and on linearisations.

``tuning`` and the rooms above may import it; it builds on ``loop``. It never changes a gain.
"""
