"""The long description of the distribution: README without links that lead nowhere.

The project has no public home. Until it has one, a link to a file of the checkout would be dead on a package
index, so its words stay and the link goes. ``home`` in ``[tool.hatch.metadata.hooks.custom]`` of
``pyproject.toml`` is the one place for the address; with it such links lead there.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_FENCE = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"(?P<picture>!?)\[(?P<words>[^\]]+)\]\((?P<target>[^)\s]+)\)")
_ELSEWHERE = re.compile(r"[a-z][a-z0-9+.-]*:|#")


def described(readme: str, home: str = "") -> str:
    """Return a README whose links to files lead to the home of the project, or are words where it has none.

    Parameters
    ----------
    readme
        Markdown.
    home
        Address before the path of a file, with a slash at its end.
    """

    def link(match: re.Match[str]) -> str:
        if _ELSEWHERE.match(match["target"]):
            return match[0]
        if not home:
            return match["words"]
        return f"{match['picture']}[{match['words']}]({home}{match['target']})"

    parts = _FENCE.split(readme)
    return "".join(part if k % 2 else _LINK.sub(link, part) for k, part in enumerate(parts))


class CustomMetadataHook(MetadataHookInterface):
    """Called by hatchling for each build."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the long description.

        Parameters
        ----------
        metadata
            The table ``[project]``.
        """
        readme = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        text = described(readme, str(self.config.get("home", "")))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
