"""Whether a change of the code changed an output: record what two checkouts write, and compare it.

    python -m tests.same_outputs record OUT [--only GROUP ...] [--quick] [--workers N]
    python -m tests.same_outputs compare BEFORE AFTER

The same file runs in an old and in a new checkout: it uses the command line and the names of the front door,
never a module below it. A job is done when its folder holds ``.done``; an interrupted recording goes on with
the others, so name a new folder for new code. Drawings, figures, decks, C, FMUs, numbers and names of
interfaces are equal, or ``compare`` ends with 1; texts for readers that were reworded are only listed. The
diagnosis also runs on the practice records of ``NLSDESIGN_SHARED``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from .comparison import show
from .dumps import OWN
from .recording import record


def main() -> int:
    """Read the command line."""
    if sys.argv[1:2] and sys.argv[1] in OWN:
        OWN[sys.argv[1]](*sys.argv[2:])
        return 0
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    asked = parser.add_subparsers(dest="what", required=True)
    recording = asked.add_parser("record", help="write what this checkout gives")
    recording.add_argument("out", type=Path)
    recording.add_argument(
        "--only", nargs="+", default=[], metavar="GROUP", help="groups, or begins of names of jobs"
    )
    recording.add_argument(
        "--quick", action="store_true", help="some jobs of every group, within four minutes"
    )
    recording.add_argument("--workers", type=int, default=1)
    comparing = asked.add_parser("compare", help="list what differs; 1 if it is more than texts")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    given = parser.parse_args()
    if given.what == "compare":
        return show(given.before, given.after)
    return record(given.out, given.only, given.quick, given.workers)


if __name__ == "__main__":
    sys.exit(main())
