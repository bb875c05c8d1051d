"""Stack and loops of every kind of code as it is compiled: ``python -m benchmarks.elf_bounds``.

Writes a table of ``docs/proofs.md``; needs ``arm-none-eabi-gcc``. The stack is that of the deepest chain of
calls from the step, of the frames that the compiler states; a loop is a branch that can be reached again from
where it leads to.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from pathlib import Path

from benchmarks._generated import every_kind, generated_files, written
from benchmarks.targets import replaced
from nlsdesign.export import CSource

PAGE = Path(__file__).parents[1] / "docs" / "proofs.md"
TARGETS = {
    ("Cortex-M4F", "float"): ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"),
    ("Cortex-M7", "float"): ("-mcpu=cortex-m7", "-mfpu=fpv5-d16"),
    ("Cortex-M7", "double"): ("-mcpu=cortex-m7", "-mfpu=fpv5-d16"),
}
HEAD = (
    "| | processor | number type | stack of a step, B | calls outside | loops |",
    "| --- | --- | --- | ---: | --- | ---: |",
)
_FRAME = re.compile(r'node: \{ title: "([^"]+)" label: "\S+?\\n\S+\\n(\d+) bytes \(static\)')
_CALL = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
_LINE = re.compile(r"^\s*([0-9a-f]+):\t[0-9a-f ]+\t(\S+)\s*(?:.*?([0-9a-f]+) <[\w.]+(?:\+0x[0-9a-f]+)?>)?")
_ENDS = re.compile(r"^(b|b\.n|b\.w|bx|udf)$|^(pop|ldmia\.w|ldr\.w)$")


def chain(frames: dict[str, int], calls: list[tuple[str, str]], function: str) -> tuple[int, set[str]]:
    """Return the bytes of the deepest chain of calls from a function, and all that it calls."""
    below = [(target, chain(frames, calls, target)) for source, target in calls if source == function]
    reached = set().union(*({target} | further for target, (_, further) in below))
    return frames.get(function, 0) + max((size for _, (size, _) in below), default=0), reached


def loops(disassembly: str) -> int:
    """Return how many branches of a disassembly can be reached again from where they lead to."""
    lines = [match for line in disassembly.splitlines() if (match := _LINE.match(line))]
    follows: dict[int, list[int]] = {}
    for match, after in zip(lines, [*lines[1:], None], strict=True):
        jump = match[2].startswith(("b", "cb")) and not match[2].startswith(("bl", "bic", "bfi", "bkpt"))
        leaves = _ENDS.match(match[2]) and (match[2][0] in "bu" or "pc" in match.string)
        follows[int(match[1], 16)] = [int(match[3], 16)] if jump and match[3] else []
        if after and not leaves:
            follows[int(match[1], 16)].append(int(after[1], 16))
    done: set[int] = set()
    count = 0
    for first in follows:
        path: dict[int, list[int]] = {} if first in done else {first: list(follows[first])}
        while path:
            here = next(reversed(path))
            if not path[here]:
                done.add(here)
                del path[here]
                continue
            there = path[here].pop()
            count += there in path
            if there in follows and there not in done and there not in path:
                path[there] = list(follows[there])
    return count


def bounds(source: CSource, flags: tuple[str, ...]) -> tuple[int, set[str], int]:
    """Return bytes of stack, functions of others that are called, and loops of all functions."""
    folder, frames, calls, count = source.header.parent, {}, [], 0
    for file in generated_files(source):
        build = ["-mthumb", "-mfloat-abi=hard", "-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno"]
        target = folder / f"{file.stem}.o"
        command = ["arm-none-eabi-gcc", *flags, *build, "-fcallgraph-info=su", f"-I{folder}", "-c", str(file)]
        subprocess.run([*command, "-o", str(target)], check=True)
        graph = target.with_suffix(".ci").read_text(encoding="utf-8")
        frames |= {name: int(size) for name, size in _FRAME.findall(graph)}
        calls += _CALL.findall(graph)
        shown = ["arm-none-eabi-objdump", "-d", str(target)]
        count += loops(subprocess.run(shown, check=True, capture_output=True, text=True).stdout)
    steps = [chain(frames, calls, name) for name in frames if name.endswith("_step")]
    reached = set().union(*(names for _, names in steps))
    return max(size for size, _ in steps), reached - set(frames), count


def main() -> None:
    """Write the table."""
    lines = list(HEAD)
    for name, model in every_kind().items():
        for (processor, real), flags in TARGETS.items():
            with tempfile.TemporaryDirectory() as folder:
                stack, outside, count = bounds(written(name, model, Path(folder), real), flags)
            calls = ", ".join(f"`{each}`" for each in sorted(outside)) or "none"
            lines.append(f"| {name} | {processor} | {real} | {stack} | {calls} | {count or 'none'} |")
            print(lines[-1], flush=True)
    PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8"), {"bounds": lines}), encoding="utf-8")


if __name__ == "__main__":
    main()
