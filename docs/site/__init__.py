"""The documentation site: pages of ``docs`` and pages made from the package, built by Sphinx.

``python -m docs.site out/docs`` stages the sources beside the result and builds; nothing is written into the
tree. Pages made from the package cannot fall behind it.
"""
