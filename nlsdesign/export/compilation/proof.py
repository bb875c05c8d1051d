"""Proofs about a generated step, for all inputs at once: Eva, the value analysis of Frama-C, reads the C.

Eva computes with sets of values, so what it says holds for every number that the type can hold. Three things
are written anew for it, in a copy, and mean the same:

- ``(a - a) + (b - b) >= 0``, with which the step asks whether numbers are finite, becomes a comparison of
  each with the largest number: a - a is 0 where a is finite, else not a number, and no sum with that is >= 0;
- ``fabs`` and ``copysign`` get a body (but for the sign of a zero, which no number of the step depends on);
- behind each comparison that holds stands that its sides are numbers, as IEEE 754 has it; Eva 25 misses that.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...foundation.errors import ExportError
from ...foundation.processes import run_to_end
from ..c.c_text import Real
from ..c.writer import CSource
from ..files import filled

PROVER = "frama-c"
_SECONDS = 1800
_OPTIONS = (
    "-eva-precision", "1", "-eva-slevel", "300", "-eva-interprocedural-splits", "-warn-special-float", "none",
    "-eva-msg-key=-final-states",
)  # fmt: skip
_GUARD = re.compile(r"\(((?:\(\w+ - \w+\)(?: \+ )?)+) >= 0\.0f?\)")
_NAME = r"[A-Za-z_]\w*(?:(?:->|\.)\w+|\[[^\]]*\])*"
_BRANCH = re.compile(r"^(\s*(?:else )?if \()(.+?) (<|>|<=|>=) (.+?)\)(\s.*|)$")
_SHOWN = re.compile(r"Frama_C_show_each_(\w+):\s*\{(\d+)\},\s*([^\n]+)")
_ALARM = re.compile(r"^\[eva:alarm\] [^:\n]*:(\d+): Warning:\s*([^\[]*)", re.MULTILINE)
_NUMBER = re.compile(r"-?(?:\d+\.?\d*(?:e[+-]?\d+)?|inf)")
_LOADING = ("_load", "_check", "_checksum")
_REACHED = re.compile(r"(\d+) statements reached \(out of (\d+)\)")
_BODIES = """\
static {real} fabs_({real} x) {{ return x < ({real})0 ? -x : x; }}
static {real} copysign_({real} x, {real} y)
{{ const {real} size = fabs_(x); return y < ({real})0 ? -size : size; }}
"""


@dataclass(frozen=True)
class StepProof:
    """What was proved of a generated step, for all inputs, accepted parameters and numbers of steps."""

    name: str
    # alarms: what may be undefined, as Eva says it, with the line of the copy that it read; empty where
    # nothing is
    alarms: tuple[str, ...]
    open_members: tuple[str, ...]  # members that were not proved finite after a step; empty where all were
    beyond: tuple[str, ...]  # outputs that were not proved to stay within the limits that the header states
    loops: tuple[str, ...]  # functions of the step that hold a loop or a jump, which nothing bounds
    # reached, statements: how many statements the analysis reached, and of how many
    reached: int
    statements: int
    seconds: float

    @property
    def holds(self) -> bool:
        """Whether nothing is undefined, all stays finite and within its limits, and the work is bounded."""
        return not (self.alarms or self.open_members or self.beyond or self.loops)

    def words(self) -> tuple[str, ...]:
        """Return what was proved, or what is open, in sentences."""
        if self.holds:
            return (
                "proved of the step for all inputs and any number of steps: nothing is undefined, all stays "
                "finite, outputs within their limits, no loop",
            )
        kinds = {
            "may be undefined": self.alarms,
            "not proved finite": self.open_members,
            "not proved to stay within its limits": self.beyond,
            "holds a loop or a jump": self.loops,
        }
        return tuple(f"{kind}: {each}" for kind, texts in kinds.items() for each in texts)


def missing_prover() -> str:
    """Return why nothing can be proved, or an empty text."""
    if shutil.which(PROVER) is None:
        return f"{PROVER} is not installed (Debian: apt-get install frama-c-base)"
    return ""


def prove_step(source: CSource) -> StepProof:
    """Prove what a generated step never does, whatever it is given.

    Of a state of any content, any inputs and any parameters: no access beyond an array or structure, no
    conversion of a number that does not fit, no overflow of a signed number, no shift too far, nothing read
    that was not set. Of a state after :c:func:`init`, by induction over the steps, where parameters may be
    set anew before each: all outputs, states, taken inputs and remembered readings are finite, and outputs
    are within the limits that the header states. That the step has no loop is read off its text. Code that
    loads parameter blocks is not looked at.

    Parameters
    ----------
    source
        As :func:`~nlsdesign.export.export_c` has written it.

    Returns
    -------
    StepProof
        Holds or names what is open.

    Raises
    ------
    ExportError
        If Frama-C is not installed, or cannot read the code.
    """
    missing = missing_prover()
    if missing:
        raise ExportError("a proof", f"needs Frama-C: {missing}", next_step="install it")
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        shutil.copy(source.header, folder / source.header.name)
        copy, harness = folder / source.source.name, folder / "proof.c"
        code = source.source.read_text(encoding="utf-8")
        copy.write_text(_readable(code, source.real), encoding="utf-8")
        # Printed by Frama-C each comparison is the condition of a branch of its own.
        printed = _run([str(copy), "-no-annot", "-print"], folder).partition("/* Generated by Frama-C */")[2]
        copy.write_text(with_numbers_admitted(printed), encoding="utf-8")
        members = _members(source)
        harness.write_text(_harness(source, members), encoding="utf-8")
        files = [str(harness), str(copy)]
        anything = _run([*_OPTIONS, *files, "-eva", "-main", "any_content"], folder)
        induction = _run([*_OPTIONS, *files, "-eva", "-main", "every_step"], folder)
    # In both runs: of any content a number may be anything, so a conversion that fits there always fits.
    alarms = tuple(
        f"line {line}: {' '.join(text.split())}"
        for output in (anything, induction)
        for line, text in _ALARM.findall(output)
    )
    reached, statements = (int(number) for number in (_REACHED.findall(induction) or [(0, 0)])[-1])
    beyond = tuple(
        path
        for number, (path, v) in enumerate(
            zip(source.writer.paths.outputs, source.model.outputs, strict=True)
        )
        if not _within(induction, f"outputs_{number}", v.minimum, v.maximum)
    )
    # The members that were not shown finite wherever they were shown, or not shown at all.
    finite: dict[str, bool] = {}
    for label, _, values in _SHOWN.findall(induction):
        good = "NaN" not in values and "inf" not in values and "--" not in values
        finite[label] = finite.get(label, True) and good
    at_first = [label.removeprefix("at_first_") for label, good in finite.items() if not good]
    open_members = tuple(
        path for label, path in members.items() if not finite.get(label, False) or label in at_first
    )
    return StepProof(
        name=source.name, alarms=alarms, open_members=open_members, beyond=beyond,
        loops=_loops(code), reached=reached, statements=statements, seconds=time.perf_counter() - begin,
    )  # fmt: skip


def _loops(code: str) -> tuple[str, ...]:
    """Return the functions that hold a loop or a jump, without those that load parameter blocks."""
    texts, function = [], ""
    for line in re.sub(r"/\*.*?\*/", "", code, flags=re.DOTALL).splitlines():
        head = re.match(r"\w[\w ]* \*?(\w+)\(", line)
        function = head[1] if head else function
        if re.search(r"\b(?:for|while|do|goto)\b", line) and not function.endswith(_LOADING):
            texts.append(function)
    return tuple(dict.fromkeys(texts))


def _within(output: str, label: str, lowest: float, highest: float) -> bool:
    """Tell whether all values of an output that Eva shows are within limits, as far as it prints digits."""
    names = (label, f"kept_{label}", f"at_first_kept_{label}")
    shown = [values for name, _, values in _SHOWN.findall(output) if name in names]
    numbers = [float(number) for values in shown for number in _NUMBER.findall(values)]
    if not numbers or any("NaN" in values for values in shown):
        return False
    slack = 1e-6 * max((abs(limit) for limit in (lowest, highest) if math.isfinite(limit)), default=0.0)
    return lowest - slack <= min(numbers) and max(numbers) <= highest + slack


def _readable(code: str, real: Real) -> str:
    """Return code with the guards of finite numbers, ``fabs`` and ``copysign`` in words that Eva knows."""

    def compared(guard: re.Match[str]) -> str:
        names = re.findall(r"\((\w+) - \w+\)", guard[1])
        return f"({' && '.join(f'{n} >= -{_largest(real)} && {n} <= {_largest(real)}' for n in names)})"

    text = re.sub(r"\b(fabs|copysign)f?\(", r"\1_(", _GUARD.sub(compared, code))
    return _BODIES.format(real=real) + text


def _largest(real: Real) -> str:
    return "FLT_MAX" if real is Real.FLOAT else "DBL_MAX"


def with_numbers_admitted(code: str) -> str:
    """Return printed code that says behind each comparison that holds that its sides are numbers."""
    lines: list[str] = []
    for line in code.splitlines():
        if (
            lines
            and re.match(r"\s*(?:else )?if \(", lines[-1])
            and lines[-1].count("(") > lines[-1].count(")")
        ):
            lines[-1] += f" {line.strip()}"
        else:
            lines.append(line)
    for number, line in enumerate(lines):
        branch = _BRANCH.match(line)
        if branch is None:
            continue
        head, left, sign, right, rest = branch.groups()
        sides = [re.sub(r"^\s*\((?:double|float)\)", "", side).strip() for side in (left, right)]
        admitted = " ".join(
            f"/*@ admit !\\is_NaN((double){side}); */" for side in sides if re.fullmatch(_NAME, side)
        )
        if admitted:
            block, rest = ("{ ", rest.strip()[1:]) if rest.strip().startswith("{") else ("", rest)
            lines[number] = f"{head}{left} {sign} {right}) {block}{admitted}{rest}"
    # Whether the machine has begun decides whether its memory was set in this step: the cases stay apart.
    split = r"\1  /*@ dynamic_split state->begun; */" + "\n"
    return re.sub(r"(static uint32_t \w+_take\([^{]*\{\n(?:  \w[^\n]*;\n)*)", split, "\n".join(lines))


def _members(source: CSource) -> dict[str, str]:
    """Return all that has to be finite, as C text, by a label that Eva repeats with its values."""
    paths, readings = source.writer.paths, source.writer.readings
    remembered = ("last", "slope", "candidate", "mover")
    groups = {
        "outputs": [f"outputs.{path}" for path in paths.outputs],
        "kept_outputs": [f"state.outputs.{path}" for path in paths.outputs],
        "states": [f"state.states.{path}" for path in paths.states],
        "inputs": [f"state.inputs.{path}" for path in paths.inputs],
        "readings": [f"state.readings[{k}].{name}" for k in range(len(readings)) for name in remembered],
    }
    return {f"{group}_{k}": path for group, members in groups.items() for k, path in enumerate(members)}


def _harness(source: CSource, members: dict[str, str]) -> str:
    """Return the program whose values Eva computes."""
    real = source.real
    inside = {label: path for label, path in members.items() if path.startswith("state.")}
    at_first = {label: path for label, path in inside.items() if not label.startswith(("states", "inputs"))}
    unknown = ["Frama_C_make_unknown((char *)&state.readings, sizeof state.readings);"]
    values = {
        "name": source.name,
        "real": source.real,
        "largest": _largest(source.real),
        "shown_at_first": _shown("at_first_", at_first),
        "supposed": [
            *(unknown if source.writer.readings else []),
            *(f"{path} = any_finite();" for path in inside.values()),
            *(
                f"state.outputs.{path} = Frama_C_{real}_interval("
                f"{real.literal(v.minimum)}, {real.literal(v.maximum)});"
                for path, v in zip(source.writer.paths.outputs, source.model.outputs, strict=True)
                if math.isfinite(v.minimum) and math.isfinite(v.maximum)
            ),
        ],
        "shown": _shown("", members),
    }
    return filled("proof.c", values)


def _shown(prefix: str, members: dict[str, str]) -> list[str]:
    return [f"Frama_C_show_each_{prefix}{label}(0, {path});" for label, path in members.items()]


def _run(words: Sequence[str] | Iterable[str], folder: Path) -> str:
    """Run Frama-C and return what it prints."""
    flags = f"-std=c99 -I{folder}"
    command = [PROVER, "-machdep", "x86_64", f"-cpp-extra-args={flags}", *words]
    try:
        done = run_to_end(command, seconds=_SECONDS)
    except subprocess.TimeoutExpired as error:
        raise ExportError(
            "a proof", f"does not end within {_SECONDS} s", next_step="prove a smaller step"
        ) from error
    if done.returncode != 0:
        last = (done.stdout + done.stderr).strip()[-300:]
        raise ExportError("a proof", f"fails: {last}", next_step="report it with the code")
    return done.stdout + done.stderr
