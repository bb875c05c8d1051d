"""The law that the page on own laws shows, as a module that a deck or a test can be extended by."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

from nlsdesign.foundation.extensions import load_extension

PAGE = Path(__file__).parents[1] / "docs" / "how_to" / "own_law.md"


def documented_law(folder: Path) -> ModuleType:
    """Write the first block of the page into a file of its own, as the page says, and load it."""
    block = re.search(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert block
    file = folder / "my_laws.py"
    file.write_text(block[1], encoding="utf-8")
    return load_extension(str(file))
