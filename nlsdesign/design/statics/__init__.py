"""Rubber and cam at rest: the elastic law, the closed form by energy, contours, declared cams.

May be imported by tolerance, drawing and optimisation. Never optimises.
"""
