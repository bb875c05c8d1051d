"""Command lines: every command with options, files, folders and numbers that nobody should give."""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import click

from nlsdesign.cli.main import main, program
from nlsdesign.foundation.text_files import LIST_NAME

from .cases import ACCEPTED, REFUSED, Case, Outcome, signature
from .records import _JOB, _MAPPING, _TARGET, Records

DECKS = (
    "dfki_pendulum",
    "vhb4910_specimen",
    "austin2015_soft_spring",
    "one_sided_cable_drive",
    "test_rig",
    "deck.toml",
)
ODD_PATHS = (
    "", ".", "..", "/", "-", "--", "/dev/null", "/dev/null/x", "/dev/full", "/dev/zero", "/proc/self/mem",
    "/proc/x", "missing", "missing.toml", "empty", "empty.toml", "empty.csv", "binary.toml", "binary.csv",
    "latin.toml", "folder", "folder.toml", "folder/x", "x" * 300, "x" * 300 + ".toml",
    "a/" * 2500, "\udcff.toml",
    "\udcff", "\x1b[31mred\x1b[0m", "deck.toml/x", "deck.toml", "record.csv", "records", "job.toml", "~", "*",
    "locked/x", "new\nline", "a\x00b",
)  # fmt: skip
ODD_NUMBERS = (
    "", "-1", "0", "-0", "1e308", "-1e308", "1e400", "nan", "inf", "-inf", "1e-320", "3.5",
    "9" * 400, "9" * 5000,
    "1_000", "0x10", "\uff11", "text", "5 apples", "5 N*m", "5 ms", "5 rad", "5 deg", "1e308 Gg*m^2",
    "1 m^99",
    "5 Hz", "-5 ms", "nan s", "1e-300 s", "1e300 s", "5 " + "m*" * 500, "\x1b[2J", "\udcff", "1,5", "--",
    "1e6 s",
)  # fmt: skip
ODD_WORDS = (
    "", " ", "x" * 300, "x" * 5000, "\udcff", "\x1b]0;title\x07", "../..", "motor", "spring",
    "motor.angle", "load",
    "spring.rubber", "nothing.there", "=", "a=b", "a=", "=b", "a=b*", "a=b@", "[", "*", "**", "{", "'",
    "-1", "@",
    "MaximumCamRadius = {radius = '20 mm'}", "MaximumCamRadius = {radius = [[", "TorqueError = {}",
    "x = 1\ny = 2",
    "PowerTorque = {coefficient = 4.35}", "one=one.fmu", "one.u=one.y", "1@2", "1@0", "nan@nan",
    "1e308@1e308",
)  # fmt: skip
STUDIES = {
    "no_main.py": b"x = 1\n",
    "none.py": b"def main(out, fast=False):\n    return None\n",
    "out_only.py": b"def main(out):\n    return None\n",
    "broken.py": b"def main(out, fast=False)\n    return None\n",
    "raises.py": b"def main(out, fast=False):\n    return 1 / 0\n",
    "raises_early.py": b"import nothing_of_that_name\n",
    "number.py": b"def main(out, fast=False):\n    return 5\n",
    "texts.py": b"class R:\n    numbers = {'a': 'b'}\ndef main(out, fast=False):\n    return R()\n",
    "leaves.py": b"import sys\ndef main(out, fast=False):\n    sys.exit(3)\n",
    "not_text.py": b"\xff\xfe\x00",
    "main_is_five.py": b"main = 5\n",
    "null.py": b"main = 5\x00\n",
}


_SERVED = 15
"""Seconds for which a page is served."""


class Commands:
    """Words made from the program's own list of commands and options, half of them unusual."""

    limit = 40.0
    patient = True  # a command may work for long

    def __init__(self) -> None:
        records = Records()
        csv = records._csv.encode()
        deck = (Path(__file__).parents[2] / "models/decks/dfki_pendulum.toml").read_bytes()
        self._files = {
            "deck.toml": deck, "record.csv": csv,
            **{f"records/{name}.csv": csv for name in "abc"},
            "mapping.toml": _MAPPING.encode(), "job.toml": _JOB.encode(), "curve.csv": _TARGET.encode(),
            "empty": b"", "empty.toml": b"", "empty.csv": b"", "locked/.keep": b"",
            "binary.toml": bytes(range(256)),
            "binary.csv": bytes(range(256)) * 20, "latin.toml": 'x = "\xe4"'.encode("latin-1"),
            "folder/x.txt": b"x", "folder.toml/x": b"", **STUDIES,
        }  # fmt: skip
        self._commands = sorted(_leaves(program, ()), key=lambda pair: pair[0])

    def made(self, random: random.Random, number: int) -> Case:
        words, command = self._commands[number % len(self._commands)]
        for parameter in command.params:
            required = parameter.required
            if random.random() > (0.93 if required else 0.25):
                continue
            words += self._words_of(random, parameter)
        if random.random() < 0.1:
            words += (
                random.choice(("--nothing", "--help", "-x", "extra", "--json=5", "--out", "\udcff", "")),
            )
        if random.random() < 0.05:
            words = words[1:]
        return Case(self._files, tuple(word.replace("\x00", "") for word in words), "words")

    def _words_of(self, chance: random.Random, parameter: click.Parameter) -> tuple[str, ...]:
        option = max(parameter.opts, key=len)
        if getattr(parameter, "is_flag", False):
            return (option,)
        value = self._value(chance, parameter, option)
        return (option, value) if isinstance(parameter, click.Option) else (value,)

    @staticmethod
    def _value(chance: random.Random, parameter: click.Parameter, option: str) -> str:
        odd = chance.random() < 0.4
        kind = parameter.type
        if isinstance(kind, click.Choice):
            return chance.choice(ODD_WORDS if odd else tuple(map(str, kind.choices)))
        if option in ("--deck", "deck_name"):
            return chance.choice(ODD_PATHS if odd else DECKS)
        if option == "name" and chance.random() < 0.5:
            return chance.choice((*STUDIES, "hello", "Yeoh", "PMC-770", *ODD_PATHS))
        if isinstance(kind, click.Path):
            usual = {"--record": "record.csv", "--records": "records", "--mapping": "mapping.toml",
                     "--task": "job.toml", "--target-file": "curve.csv", "--out": "out"}  # fmt: skip
            return chance.choice(ODD_PATHS) if odd or option not in usual else usual[option]
        if isinstance(kind, click.types.IntParamType):
            return chance.choice(ODD_NUMBERS) if odd else str(chance.randint(1, 4))
        if isinstance(kind, click.types.FloatParamType):
            return chance.choice(ODD_NUMBERS) if odd else f"{chance.uniform(0, 3):.2f}"
        unit = getattr(kind, "unit", None)
        if unit is not None:
            return chance.choice(ODD_NUMBERS) if odd else f"{chance.uniform(0, 20):.3f} {unit}"
        return chance.choice((*ODD_WORDS, *ODD_NUMBERS))

    def judged(self, case: Case, folder: Path) -> Outcome:
        place = folder / "temporary"
        place.mkdir()
        (folder / "locked").chmod(0o500)
        before, tempfile.tempdir = tempfile.tempdir, str(place)
        here, words = os.getcwd(), sys.argv
        os.chdir(folder)
        sys.argv = ["nlsdesign", *case.words]
        try:
            outcome = _run(interrupted=case.words[:1] == ("serve",))
        finally:
            os.chdir(here)
            sys.argv, tempfile.tempdir = words, before
            (folder / "locked").chmod(0o700)
        if outcome.wrong:
            return outcome
        # The kept binaries of the compiler stay; drafts and folders of work do not.
        left = [each.name for each in place.iterdir() if not each.name.startswith("nlsdesign-0")
                and each.name != f"nlsdesign-{os.getuid()}"]  # fmt: skip
        drafts = [each.name for each in folder.rglob(".*") if each.name not in (".keep", ".cache", LIST_NAME)]
        if left or drafts:
            return Outcome("left over", str((left + drafts)[0])[:20])
        return outcome


def _leaves(
    command: click.Command, words: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    if not isinstance(command, click.Group) or command.invoke_without_command:
        yield words, command
    for name, inner in getattr(command, "commands", {}).items():
        yield from _leaves(inner, (*words, name))


def _run(*, interrupted: bool) -> Outcome:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if interrupted:  # as by a hand: this command ends in no other way
        signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
        signal.alarm(_SERVED)
    try:
        main()
    except SystemExit as leaving:
        status = leaving.code or 0
        if status in (0, 1, 141) or (interrupted and status == 130):
            return Outcome(ACCEPTED)
        return Outcome(REFUSED) if status == 2 else Outcome("traceback", f"exit status {status!r}")
    except BaseException as error:
        return Outcome("traceback", signature(error))
    finally:
        signal.alarm(0)
    return Outcome(ACCEPTED)
