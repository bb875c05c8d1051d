"""Design studies: each has ``main(out, fast, steps)`` and claims its numbers in ``expected.toml``."""
