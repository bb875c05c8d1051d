"""Laws of rubber: hyperelastic, viscous, with memory, with temperature; and those of the library of rubbers.

The assembly room and everything outside ``components`` may import it; it builds on ``core`` alone.
It never knows which cam or machine stretches the rubber.
"""
