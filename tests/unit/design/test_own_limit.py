"""A limit of one's own: the page that shows it is followed to the letter."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ASKED = """
import sys
from nlsdesign.foundation.extensions import load_extension
from nlsdesign.live.edits import change_limit, edit
from nlsdesign.live.gallery import gallery_question

load_extension(sys.argv[1])
question = gallery_question("cam-actuator")
asked = edit(change_limit, "LeastContourRadius", 0.004).applied(question)
(row,) = [limit for limit in asked.keep if type(limit).__name__ == "LeastContourRadius"]
assert row.radius == 0.004
print(asked.limit_values["LeastContourRadius"].kind.title)
"""


@pytest.mark.slow
def test_the_page_on_a_limit_of_ones_own(root: Path, tmp_path: Path) -> None:
    """In processes of their own, so that no other test knows the limit."""
    page = (root / "docs/how_to/own_limit.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```$", page, flags=re.MULTILINE | re.DOTALL)
    (tmp_path / "my_limits.py").write_text(block, encoding="utf-8")

    def python(*words: str) -> str:
        command = [sys.executable, *words]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    listed = python("-m", "nlsdesign", "--with", "my_limits.py", "design", "--list", "limits")
    assert "LeastContourRadius" in listed
    assert "Least distance from the centre, in m." in " ".join(listed.split())
    assert python("-c", ASKED, "my_limits.py") == "least distance of the contour from the centre\n"
