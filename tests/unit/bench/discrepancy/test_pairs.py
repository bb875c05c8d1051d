"""When the search looks for two effects at once."""

from __future__ import annotations

from typing import Any, cast

import pytest

from nlsdesign.bench.discrepancy.selection.comparison import Comparison
from nlsdesign.bench.discrepancy.selection.criteria import Criteria
from nlsdesign.bench.discrepancy.selection.hypothesis import Hypothesis
from nlsdesign.bench.discrepancy.selection.search import Revision, _Search
from nlsdesign.bench.discrepancy.selection.trials import Step, Trials
from nlsdesign.components import Fixed
from nlsdesign.components.assembly.named_parts import assembly


@pytest.mark.parametrize(("alone", "far", "paired"), [(0, True, 1), (1, True, 1), (1, False, 0)])
def test_pairs_are_tried_where_no_effect_was_named_or_much_is_left_beside_it(
    monkeypatch: pytest.MonkeyPatch, alone: int, far: bool, paired: int
) -> None:
    start = Hypothesis(assembly("blank", load=Fixed()))
    named, pairs = iter([Step(start, "motor", 0.9)] * alone), list[Any]()

    def pair(self: _Search, *given: Any) -> list[Step]:
        pairs.append(given)
        return []

    monkeypatch.setattr(_Search, "_lacking", lambda *given: ["motor"])
    monkeypatch.setattr(Trials, "tried_on", lambda *given, **flags: [])
    monkeypatch.setattr(f"{_Search.__module__}.account", lambda *given: ())
    monkeypatch.setattr(_Search, "_is_far_from_closed", lambda *given: far)
    monkeypatch.setattr(Revision, "enriched", lambda self, steps: steps)
    monkeypatch.setattr(Trials, "step", lambda *given: next(named, None))
    monkeypatch.setattr(_Search, "_pair", pair)
    monkeypatch.setattr(_Search, "_plainer", lambda self, step, *given: [step])
    steps = _Search(Trials(cast(Comparison, None), (), Criteria(), lambda text: None))._forward(start)
    assert (len(steps), len(pairs)) == (alone, paired)
