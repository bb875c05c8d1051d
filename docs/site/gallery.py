"""Pages of the studies: text of their docstrings, figures that a command made, numbers that they claim."""

from __future__ import annotations

from pathlib import Path


def pages(root: Path, folder: Path) -> dict[str, str]:
    """Return one page for each study and one that shows them all."""
    return {"gallery/index.md": "# Gallery\n"}
