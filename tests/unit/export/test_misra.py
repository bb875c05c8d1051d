"""Each deviation of generated C from MISRA C:2012 is argued, and none is from a required rule."""

from __future__ import annotations

import pytest

from benchmarks import misra
from benchmarks._generated import MONITOR, monitor_plan, written
from nlsdesign.export import export_c, write_examples
from tests.hand_built import controller, observer

needs_cppcheck = pytest.mark.skipif(misra.cppcheck() is None, reason="cppcheck is not installed")


@pytest.mark.long_cases("observer-double", "controller-double", "observer-float")
@needs_cppcheck
@pytest.mark.parametrize("real", ["float", "double"])
@pytest.mark.parametrize("model", [observer(), controller()], ids=["observer", "controller"])
def test_every_deviation_is_advisory_and_argued(model, real, tmp_path):
    counts = {"it": misra.deviations(export_c(model, tmp_path, real=real))}
    assert counts["it"]["12.1"] > 0
    assert misra.unargued(counts) == []


@needs_cppcheck
def test_the_supervisor_keeps_the_required_rules(tmp_path):
    """It left out two final branches (15.7) and cast a difference (10.8)."""
    source = export_c(controller(), tmp_path)
    write_examples(source)
    counts = misra.deviations(source)
    assert counts["12.1"] > 0
    assert misra.unargued({"it": counts}) == []


@pytest.mark.slow
@needs_cppcheck
def test_the_monitor_keeps_the_required_rules(tmp_path):
    """It assigned choices between small literals to wider numbers (10.6)."""
    source = written(MONITOR, monitor_plan().model, tmp_path, "float")
    assert misra.unargued({"it": misra.deviations(source)}) == []


@needs_cppcheck
def test_a_new_deviation_is_noticed(tmp_path):
    source = export_c(controller(), tmp_path)
    text = source.source.read_text()
    source.source.write_text(
        text.replace("    return status;\n", "    goto end;\nend:\n    return status;\n", 1)
    )
    assert misra.unargued({"it": misra.deviations(source)}) == ["15.1"]


def test_all_arguments_are_for_advisory_rules_and_stand_on_the_page(root):
    page = (root / "docs" / "misra.md").read_text(encoding="utf8")
    for rule, (category, _, argument) in misra.ARGUMENTS.items():
        assert category == "advisory"
        assert f"| {rule} | advisory |" in page
        assert argument in page
