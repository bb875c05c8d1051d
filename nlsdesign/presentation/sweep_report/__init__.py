"""The page of a sweep: what was asked, what failed, on which points no other improves, figures, decks.

The command and the front door import it. It computes no answers and draws nothing itself: `sweeps` judges the
points, `figures` draws them.
"""

from .sweep_page import write_sweep_report

__all__ = ["write_sweep_report"]
