"""The long description of the distribution: README without links that lead nowhere.

The project has no public home. Until it has one, a link to a file of the checkout would be dead on a package
index, so its words stay and the link goes. ``home`` in ``[tool.hatch.metadata.hooks.custom]`` of
``pyproject.toml`` is the one place for the address; with it such links lead there. In the pages that travel
in the wheel, links to files that do not travel with them are words too.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

# Pip builds before it compares versions, and an old Python would fail there by a call that it does not know.
if sys.version_info < (3, 11):  # noqa: UP036
    raise SystemExit(f"nlsdesign needs Python 3.11 or newer; this is {sys.version.split()[0]}.")

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


_TRAVEL = ("docs", "models", "studies")
"""Folders that lie side by side in the wheel as they do in the checkout."""


def travelling(page: str, folder: Path, root: Path) -> str:
    """Return a page whose links to files that do not lie beside it in the wheel are words.

    Parameters
    ----------
    page
        Markdown.
    folder
        Where the page stands in the checkout.
    root
        Of the checkout.
    """

    def link(match: re.Match[str]) -> str:
        if _ELSEWHERE.match(match["target"]):
            return match[0]
        target = (folder / match["target"].partition("#")[0]).resolve()
        stays = any(target.is_relative_to(root.resolve() / each) for each in _TRAVEL)
        return match[0] if stays else match["words"]

    parts = _FENCE.split(page)
    return "".join(part if k % 2 else _LINK.sub(link, part) for k, part in enumerate(parts))


class CustomBuildHook(BuildHookInterface):  # type: ignore[type-arg]
    """Called by hatchling for each wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Let pages travel without links that would be dead.

        Parameters
        ----------
        version
            Kind of the wheel; an editable one leads to the checkout.
        build_data
            Gets the changed pages by their place in the wheel.
        """
        if version == "editable":
            return
        root = Path(self.root)
        self.scratch = Path(tempfile.mkdtemp(prefix="nlsdesign_docs_"))
        for number, file in enumerate(sorted((root / "docs").rglob("*.md"))):
            page = file.read_text(encoding="utf-8")
            changed = travelling(page, file.parent, root)
            if changed != page:
                draft = self.scratch / f"{number}.md"
                draft.write_text(changed, encoding="utf-8", newline="\n")
                place = f"nlsdesign/_bundled/{file.relative_to(root).as_posix()}"
                build_data["force_include"][str(draft)] = place

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the changed pages.

        Parameters
        ----------
        version, build_data
            As for :meth:`initialize`.
        artifact_path
            Of the wheel.
        """
        if version != "editable":
            shutil.rmtree(self.scratch)


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
