"""Build the site: ``python -m docs.site FOLDER``; exit status 1 where there is a warning or a dead link."""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from pathlib import Path

from . import check, listings, stage

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    """Stage, build and check; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m docs.site", description=__doc__)
    parser.add_argument("out", type=Path, nargs="?", default=Path("out/docs"), help="folder of the site")
    parser.add_argument("--jobs", type=int, default=2, help="processes that read and write pages")
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    source = out.with_name(out.name + "_source")
    for folder in (out, source):
        shutil.rmtree(folder, ignore_errors=True)
    begin = time.monotonic()
    linked = stage.stage(ROOT, source)
    staged = time.monotonic()
    from sphinx.cmd.build import build_main

    options = ["-q", "-W", "--keep-going", "-b", "html", "-j", str(arguments.jobs)]
    status = build_main([*options, "-c", str(ROOT / "docs" / "site"), str(source), str(out)])
    if status:
        return 1
    listings.write_listings(ROOT, out / "listings", linked)
    shutil.rmtree(out / ".doctrees", ignore_errors=True)
    problems = check.problems(out)
    for problem in problems:
        print(problem, file=sys.stderr)
    pages = len(list(out.rglob("*.html")))
    print(
        f"{pages} pages in {out}: {staged - begin:.0f} s to stage, {time.monotonic() - staged:.0f} s to build"
    )
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
