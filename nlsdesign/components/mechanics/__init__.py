"""What moves and what rubs: bodies, motors, gears, friction, stops and backlash.

The assembly room and everything outside ``components`` may import it; it builds on ``core`` alone.
It never knows a cam, a cable or a sensor.
"""
