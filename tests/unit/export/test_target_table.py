"""The page on targets says what is measured, and the goals it names are met."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import nlsdesign as nls
from benchmarks import targets
from benchmarks._faults import Forgotten, forgotten
from benchmarks._generated import DECK, supervised
from nlsdesign.export import CORTEX_M4F
from nlsdesign.export.compilation.target_run import TargetMeasurement, TargetRun, missing_emulator
from nlsdesign.feedback.control import joined
from nlsdesign.feedback.observer import design_observer_with_details, designed_observer

needs_emulator = pytest.mark.skipif(bool(missing_emulator()), reason=missing_emulator())


@pytest.fixture(scope="module")
def plant():
    return nls.flatten(nls.declare(nls.load_deck(DECK)))


def chosen(name, plant):
    """Cascade observer, it with the controller, or the default observer."""
    if name == "corrected observer":
        return nls.design_observer(plant)
    cascade = designed_observer(plant, kind="cascade").model
    if name == "cascade observer":
        return cascade
    return joined(cascade, nls.torque_controller(plant, law=nls.control.PidTorque()))


@needs_emulator
@pytest.mark.long_cases("cascade observer and controller", "corrected observer", "cascade observer")
@pytest.mark.parametrize("name", targets.GOALS)
def test_the_goals_are_met_and_the_page_says_what_is_measured(name, plant, root):
    cost = targets.measured(chosen(name, plant), "float", CORTEX_M4F)
    assert targets.missed([targets.Row(name, "float", CORTEX_M4F, cost, True)]) == []
    page = (root / "docs" / "targets.md").read_text(encoding="utf8")
    (row,) = re.findall(rf"^\| {name} \| Cortex-M4F \| float \| (.*) \|$", page, flags=re.MULTILINE)
    usual, most, flash, memory, stack = (int(cell.replace(",", "")) for cell in row.split(" | ")[:5])
    # A change of the code moves a few instructions; a page from another time differs by more.
    instructions = cost.run.instructions
    assert usual == pytest.approx(np.median(instructions), rel=0.1)
    assert most == pytest.approx(instructions.max(), rel=0.1)
    assert flash == pytest.approx(cost.flash, rel=0.1)
    assert (memory, stack) == (cost.memory, pytest.approx(cost.run.stack.max(), abs=32))


QUOTED = (
    ("how_to/fit_the_flash.md", "cascade observer", r"Cortex-M4F: ({flash}) B"),
    ("how_to/fit_the_flash.md", "cascade observer", "Cortex-M4F: {usual}, at most {most}, "),
    ("observers.md", "cascade observer", "the cascade alone takes {usual}, {kB:.1f} kB"),
    (
        "observers.md",
        "corrected observer",
        r"{usual} instructions per sample \({most} at most\), {kB:.1f} kB",
    ),
    (
        "how_to/controller_on_a_microcontroller.md",
        "cascade observer and scheduled controller",
        "{kB:.1f} kB and",
    ),
    (
        "how_to/controller_on_a_microcontroller.md",
        "corrected observer and scheduled controller",
        "{kB:.1f} kB and",
    ),
)


@pytest.mark.parametrize(("page", "name", "pattern"), QUOTED)
def test_pages_quote_the_costs_of_the_table(root, page, name, pattern):
    """Two pages had the costs of code before it had `INNOVATION_LARGE`, and a size that is refused since."""
    table = (root / "docs" / "targets.md").read_text(encoding="utf8")
    (row,) = re.findall(rf"^\| {name} \| Cortex-M4F \| float \| (.*) \|$", table, flags=re.MULTILINE)
    usual, most, flash = row.split(" | ")[:3]
    bytes_ = int(flash.replace(",", ""))
    wanted = pattern.format(usual=usual, most=most, flash=bytes_, kB=1e-3 * bytes_)
    text = " ".join((root / "docs" / page).read_text(encoding="utf8").split())
    assert re.search(wanted, text), wanted


def test_a_missed_goal_is_named(plant, monkeypatch):
    cost = TargetMeasurement(
        source=None,
        processor=CORTEX_M4F,
        alone=None,
        added=nls.export.compilation.target_run.SectionSizes(20_000, 0, 0),
        state=10,
        run=TargetRun(np.array([450, 460, 470]), np.array([8]), np.zeros(1), np.zeros(1), True),
    )
    faults = Forgotten(faults=3, worst=0.1, beyond=2, unflagged=1, not_finite=0)
    assert targets.missed([targets.Row("cascade observer", "float", CORTEX_M4F, cost, False, faults)]) == [
        "cascade observer in float: the self-test fails",
        "cascade observer in float: a fault is neither forgotten after 0.3 s nor flagged",
        "cascade observer: 460 instructions, the goal is 440",
        "cascade observer: 20000 B of flash, the goal is 16384",
    ]


@pytest.mark.slow
def test_a_fault_is_forgotten_or_flagged_and_what_is_neither_is_seen(plant, tmp_path):
    """A supervisor that has cut leaves the machine without torque; one that hides its word is caught."""
    model = joined(
        design_observer_with_details(plant).model,
        nls.torque_controller(plant, law=nls.control.ScheduledTorque()),
    )
    source = supervised(model, tmp_path, "float")
    plain = replace(source, name="step", header=tmp_path / "step.h", source=tmp_path / "step.c")
    after = forgotten(plain, plant, 2)
    assert (after.beyond, after.unflagged, after.not_finite) == (0, 0, 0)
    assert 0.0 < after.worst < 0.01
    cut = forgotten(source, plant, 2)
    assert (cut.beyond, cut.unflagged) == (1, 0)
    text = source.source.read_text()
    source.source.write_text(text.replace("return status;", "return 0u;"))
    assert forgotten(source, plant, 2).unflagged == 1


def test_tables_are_put_between_their_marks():
    page = "a\n<!-- begin: one -->\nold\n<!-- end: one -->\nb\n"
    assert targets.replaced(page, {"one": ["| new |"]}) == page.replace("old", "| new |")
    with pytest.raises(SystemExit, match="marks of 'two' are missing"):
        targets.replaced(page, {"two": []})


@pytest.mark.slow
def test_what_all_kinds_give_has_the_same_names(plant, tmp_path):
    """Names in C: a robot's code does not change with the kind of observer."""
    named = []
    for k, model in enumerate((design_observer_with_details(plant).model, nls.design_observer(plant))):
        source = nls.export_c(model, tmp_path / str(k), real="float")
        named.append(dict(zip([v.name for v in model.outputs], source.writer.paths.outputs, strict=True)))
    cascade, corrected = named
    assert {"spring.torque", "motor.speed"} <= cascade.keys() & corrected.keys()
    assert all(corrected[name] == path for name, path in cascade.items() if name in corrected)
