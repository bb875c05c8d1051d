"""Whether a change of the code changed an output; ``python -m tests.same_outputs``."""
