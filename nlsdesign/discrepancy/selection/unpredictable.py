"""Where a body coasts between contacts: one record may go another way, however right the law.

A contact that comes a hair's breadth too late sends a free body on another course, and the prediction of that
record stays wrong. Slow motion does not depend on it. So the first look is at the slower records, no record
may decide a fit by how wrong it is, and a record that went astray is judged by the others.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from ...identification.equation_error.evidence import Evidence
from ...identification.statistics.filters import derivative
from ...identification.statistics.metrics import rmse

Key = tuple[str, str]

_SPARED = 4
"""Of so many records one, the quickest, is left out of the first look and may go astray."""
_STANDS_OUT = 2.0
"""Mean square by which it must exceed that of every other record of the block."""


def quickest(evidence: Sequence[Evidence]) -> frozenset[str]:
    """Return the quickest quarter of the records, rounded down, by the acceleration of what moves.

    Parameters
    ----------
    evidence
        Of several blocks on several records.
    """
    size: dict[str, float] = {}
    for each in evidence:
        for drive in each.driven.block.drives.values():
            if drive.order > 0:
                rows = derivative(each.record.trace[drive.signal], each.record.step, order=2)
                size[each.record.name] = max(rmse(rows), size.get(each.record.name, 0.0))
    return frozenset(sorted(size, key=lambda name: -size[name])[: len(size) // _SPARED])


def astray(
    before: Mapping[Key, float], after: Mapping[Key, float], rows: Mapping[Key, int], quick: Collection[str]
) -> frozenset[Key]:
    """Return where a quick record is predicted worse than before, or far worse than every other one.

    Parameters
    ----------
    before, after
        Sum of squares by block and record.
    rows
        Number of residuals.
    quick
        Names of the quickest records.
    """

    def stands_out(key: Key) -> bool:
        others = [after[k] / rows[k] for k in after if k[0] == key[0] and k[1] not in quick]
        return bool(others) and after[key] / rows[key] > _STANDS_OUT * max(others)

    return frozenset(k for k in after if k[1] in quick and (after[k] > before[k] + rows[k] or stands_out(k)))


def like_the_others(
    squares: Mapping[Key, float], rows: Mapping[Key, int], gone: Collection[Key]
) -> dict[Key, float]:
    """Return sums of squares in which a record that went astray is as well predicted as the others.

    Parameters
    ----------
    squares, rows
        By block and record.
    gone
        Blocks and records that went astray.
    """
    found = dict(squares)
    for block, record in gone:
        others = [k for k in squares if k[0] == block and k not in gone]
        share = sum(squares[k] for k in others) / max(sum(rows[k] for k in others), 1)
        found[block, record] = min(squares[block, record], share * rows[block, record])
    return found
