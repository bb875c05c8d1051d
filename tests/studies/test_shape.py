"""Every study has the same shape: ``main(out, fast=False)`` that returns a frozen, typed ``Results``."""

from __future__ import annotations

import ast
import dataclasses
import inspect
from pathlib import Path

import pytest

from nlsdesign.cli.studies import claims, load_study, study_names


@pytest.mark.parametrize("name", study_names())
def test_main_returns_typed_results(name: str) -> None:
    study = load_study(name)
    signature = inspect.signature(study.main)
    assert list(signature.parameters)[:2] == ["out", "fast"]
    assert all(p.default is not p.empty for p in list(signature.parameters.values())[1:])
    assert signature.return_annotation in ("Results", "Results | None")
    assert dataclasses.is_dataclass(study.Results)
    assert study.Results.__dataclass_params__.frozen
    assert isinstance(study.Results.numbers, property)
    assert not [
        f.name for f in dataclasses.fields(study.Results) if names_in(str(f.type)) & {"Any", "object"}
    ]


@pytest.mark.parametrize("name", study_names())
def test_it_claims_numbers_with_a_reason(name: str) -> None:
    expected = claims(name)
    assert expected
    assert all(claim.why and claim.unit and claim.tolerance >= 0.0 for claim in expected.values())


def test_no_study_gives_up_on_types(root: Path) -> None:
    files = sorted((root / "studies").rglob("*.py"))
    assert len(files) > 20
    loose = {file.name for file in files if "Any" in names_in(file.read_text(encoding="utf8"))}
    assert not loose


def names_in(text: str) -> set[str]:
    return {node.id for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)}
