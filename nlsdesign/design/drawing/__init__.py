"""Files for the workshop: the machined edge, holes, run-out, as DXF, SVG, CSV and STEP.

May be imported by the optimisation and by what shows results. Never decides a size.
"""
