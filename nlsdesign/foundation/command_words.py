"""A command as somebody types it: words with blanks or special characters are quoted for the shell."""

from __future__ import annotations

import os
import shlex
import subprocess


def typed_command(*words: object) -> str:
    """Return words as one line that can be copied into a shell.

    Examples
    --------
    >>> typed_command("nlsdesign", "deck", "check", "my leg.toml")
    "nlsdesign deck check 'my leg.toml'"
    """
    texts = [str(item) for item in words]
    # The shells of Windows know double quotes only.
    return subprocess.list2cmdline(texts) if os.name == "nt" else shlex.join(texts)
