"""What turns an angle into an extension and back: cams, pulleys and the cable on them.

The assembly room and everything outside ``components`` may import it; it builds on ``core`` alone.
It never knows what the cable stretches.
"""
