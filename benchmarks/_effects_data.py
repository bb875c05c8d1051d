"""A data set of hidden effects: records of the rig with what a bench would know, and the labels apart."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._score_cases import ACCEPTED, KIND_TIERS, Case
from benchmarks._score_kinds import kind_cases
from nlsdesign.bench.discrepancy.effects import ALL
from nlsdesign.foundation.text_files import write_text
from tests.rig.kind_cases import write_kind_case

FORMAT = 1
KINDS = ("geared_joint", "elastic_joint", "direct_drive", "screw_carriage")
TIERS = {tier.removeprefix("kind ").replace("single half", "half"): tier for tier in KIND_TIERS}
"""Tiers of the score by the short names that the command takes."""

README = Path(__file__).with_name("hidden_effects_readme.md")


def write_data_set(
    folder: Path, seeds: Sequence[int], kinds: Sequence[str], tiers: Sequence[str], command: str
) -> int:
    """Write the data set and return how many cases it has.

    Parameters
    ----------
    folder
        Becomes the data set; cases of an earlier one in it are removed.
    seeds, kinds
        Of the machines.
    tiers
        Some of :data:`TIERS`.
    command
        How it is made, for its README.
    """
    wanted = [c for c in kind_cases(seeds, kinds) if c.tier in {TIERS[tier] for tier in tiers}]
    # The number of a case says nothing of what it hides.
    order = np.random.default_rng(min(seeds, default=0)).permutation(len(wanted))
    for old in folder.glob("case_*"):
        shutil.rmtree(old)
    cases = {}
    for number, index in enumerate(order, start=1):
        name = f"case_{number:03d}"
        cases[name] = _write_case(folder / name, wanted[index])
    text = README.read_text(encoding="utf-8").replace("COMMAND", command).replace("FORMAT", str(FORMAT))
    write_text(folder / "README.md", text.replace("NAMES", "\n".join(_names())))
    content = {"format": FORMAT, "command": command, "cases": cases}
    write_text(folder / "truth.json", json.dumps(content, indent=1) + "\n")
    return len(cases)


def _write_case(folder: Path, case: Case) -> dict[str, Any]:
    """Write the files that a bench would leave, and return what is behind them."""
    truth = write_kind_case(
        folder, case.machine, case.effects, case.strength, case.seed,
        condition=case.noise, says_held=case.seed % 2 == 1,
    )  # fmt: skip
    (folder / "truth.json").unlink()
    return {
        "kind": case.machine, "tier": case.tier, "hidden": list(case.effects), "strength": case.strength,
        "seed": case.seed, "condition": case.noise,
        "sizes": {".".join(key): value for key, value in truth.sizes.items()}, "numbers": dict(truth.numbers),
    }  # fmt: skip


def _names() -> list[str]:
    """Return a row for each name that counts."""
    return [f"| `{effect.identifier}` | {effect.description.rstrip('.')} |" for effect in ALL]


def known_names() -> set[str]:
    """Return the names that an answer may give."""
    accepted = {name.partition("@")[0] for names in ACCEPTED.values() for name in names}
    return {effect.identifier for effect in ALL} | accepted
