"""What the bench and the controller see of a signal: sensors, their sampling and their faults.

The assembly room and everything outside ``components`` may import it; it builds on ``core`` alone.
It never knows where the signal comes from.
"""
