"""C99 for a controller: literals, structures, table look-ups, the step with its guards, the self-test.

``compilation`` and ``fmi`` may import it.
It never calls a compiler.
"""
