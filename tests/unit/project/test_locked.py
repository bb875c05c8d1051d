"""The locked packages: what a study needs is a part of all, in the same versions."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path


def locked(file: Path) -> set[tuple[str, str]]:
    """Names and versions that a list of packages pins."""
    return set(re.findall(r"^([\w.-]+)==(\S+)", file.read_text(encoding="utf-8"), re.MULTILINE))


def test_what_a_study_needs_is_a_part_of_all_that_is_locked(root: Path) -> None:
    study, everything = (locked(root / "requirements" / f"{name}.txt") for name in ("study", "locked"))
    assert study
    assert study <= everything
    names = {name for name, _ in study}
    table = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    needed = [*table["dependencies"], *table["optional-dependencies"]["export"]]
    assert {re.split(r"[\s<>=;\[]", need)[0].lower() for need in needed} <= names
    assert not names & {"sphinx", "pytest", "mypy", "mujoco", "distributed"}


def test_the_extra_for_everything_names_extras_that_there_are(root: Path) -> None:
    extras = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"][
        "optional-dependencies"
    ]
    (everything,) = extras["all"]
    named = re.fullmatch(r"nlsdesign\[(.*)\]", everything)
    assert named is not None
    assert {"export", "records", "live", "scale"} <= set(named[1].split(",")) <= set(extras)
