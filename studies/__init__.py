"""Design studies: modules and packages, each with ``main(out, fast=False)``; begin with ``hello``.

``main`` writes ``report.html`` and returns a frozen dataclass ``Results``; its property ``numbers`` gives
numbers by name, which are compared with those that ``expected.toml`` claims. What several studies use is in
the modules with an underscore.
"""
