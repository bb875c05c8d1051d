"""Symbolic design workbench for series elastic actuators whose spring is a cam that stretches rubber."""
