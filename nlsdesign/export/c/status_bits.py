"""The status word of a step: what was wrong with the inputs, and what was done about it."""

from __future__ import annotations

INPUT_HELD = 1 << 0
INPUT_SATURATED = 1 << 1
STATE_RESTARTED = 1 << 2
OUTPUT_HELD = 1 << 3
PARAMETER_REFUSED = 1 << 4
INPUT_OUT_OF_RANGE = 1 << 5
INPUT_JUMPED = 1 << 6
INPUT_STALE = 1 << 7
OUT_OF_TABLE = 1 << 8
RECOVERED = 1 << 9
WAITING = 1 << 10
FIRST_INDEX_BIT, LAST_INDEX_BIT = 16, 30

STATUS_BITS = {
    "INPUT_HELD": (
        INPUT_HELD,
        "an input was not finite; its last good value, or what was expected, was used",
    ),
    "INPUT_SATURATED": (INPUT_SATURATED, "a command was outside its range, the limit was used"),
    "STATE_RESTARTED": (
        STATE_RESTARTED,
        "the next state was not finite; the next sample begins anew from its readings",
    ),
    "OUTPUT_HELD": (OUTPUT_HELD, "an output was not finite, the last good outputs were given"),
    "PARAMETER_REFUSED": (
        PARAMETER_REFUSED,
        "a parameter was not finite or outside its range, it was not taken",
    ),
    "INPUT_OUT_OF_RANGE": (INPUT_OUT_OF_RANGE, "a reading was outside its range; what was expected was used"),
    "INPUT_JUMPED": (
        INPUT_JUMPED,
        "a reading changed faster than its largest rate; what was expected was used",
    ),
    "INPUT_STALE": (
        INPUT_STALE,
        "a reading has not changed for its stale time while the drive has; it was used all the same",
    ),
    "OUT_OF_TABLE": (OUT_OF_TABLE, "a table was read beyond its ends, where it holds its last numbers"),
    "RECOVERED": (RECOVERED, "a reading is used again after a gap"),
    "WAITING": (WAITING, "no usable reading has come yet; the outputs are those of the start"),
}


def index_bit(index: int) -> int:
    """Return the bit of the status word that names an input or parameter.

    Parameters
    ----------
    index
        Number of the input or parameter, from 0; all from 14 on share the last bit.
    """
    return 1 << min(FIRST_INDEX_BIT + index, LAST_INDEX_BIT)
