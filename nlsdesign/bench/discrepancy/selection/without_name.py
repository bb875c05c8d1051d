"""What has no name: a smooth, passive table in place of an effect, if it predicts what it has not seen."""

from __future__ import annotations

from ....foundation.errors import ConvergenceError
from ..effects.unnamed_tables import unnamed_part
from .comparison import Comparison
from .criteria import Criteria, is_more_than_noise, lacking, records_made_worse
from .excess import excesses
from .hypothesis import Hypothesis
from .measures import gain


def with_what_has_no_name(comparison: Comparison, hypothesis: Hypothesis, criteria: Criteria) -> Hypothesis:
    """Return a hypothesis with a table for what each open block leaves over, where one predicts it.

    The clauses are those of an effect that ask for prediction; no share is asked for, since nothing is named.
    """
    present = hypothesis
    for block in lacking(excesses(hypothesis, comparison.bench, criteria)):
        before = excesses(present, comparison.bench, criteria)
        fit = next((f for names, f in present.fits.items() if block in names), None)
        candidate = unnamed_part(present.assembly, fit, comparison.bench, block) if fit else None
        if candidate is None:
            continue
        try:
            tried = comparison.with_effect(present, candidate)
        except ConvergenceError:
            continue  # the block stays open, and the verdict says so as its remainder
        if tried is None:
            continue
        after = excesses(tried, comparison.bench, criteria)
        if is_more_than_noise(criteria, gain(before, after)) and not records_made_worse(
            criteria, before, after
        ):
            present = tried
    return present
