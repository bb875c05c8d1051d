"""The live design: one designer's state, edits, answers within a frame, and the page that shows them.

May be imported by ``cli``. The session (:class:`LiveDesign` and what it uses) is plain Python; server and
page stand in modules of their own. Never computes what a room below could compute.
"""

from .server import serve as serve
