"""Tests, in rooms: unit, physics, literature, golden, studies, and the tests of the house itself."""
