"""Mutated decks: read, declared, flattened, written and read again."""

from __future__ import annotations

import random
import re
from pathlib import Path

from nlsdesign.components.assembly.deck_reader import component_classes
from nlsdesign.components.assembly.deck_writer import deck_problems, deck_text, declare
from nlsdesign.foundation.deck import load_deck, read_deck
from nlsdesign.foundation.errors import NlsError
from nlsdesign.foundation.locations import folder
from nlsdesign.model import flatten

from .cases import ACCEPTED, Case, Outcome
from .mutators import (
    EVIL_NUMBERS,
    EVIL_TEXTS,
    EVIL_UNITS,
    damaged_bytes,
    damaged_lines,
    damaged_tokens,
)

_VALUE = re.compile(r"value = (\[[^\]]*\]|[^,}\n]+)")
_UNIT = re.compile(r'unit = "[^"]*"')
_SPREAD = re.compile(r"spread = [^,}\n]+")
FILE = "deck.toml"


class Decks:
    """Decks of the project, damaged as bytes, lines, tokens, structure and numbers."""

    limit = 20.0

    def __init__(self) -> None:
        files = sorted((folder("models") / "decks").glob("*.toml"))
        self._texts = [file.read_text(encoding="utf-8") for file in files]
        self._everything = "\n".join(self._texts)
        self._names = (
            *component_classes(),
            *{m[1] for m in re.finditer(r"^(\w+) =", self._everything, re.MULTILINE)},
            *{m[0] for m in re.finditer(r"\w+(?=[.\]])", self._everything)},
        )

    def made(self, random: random.Random, number: int) -> Case:
        text = random.choice(self._texts)
        names = tuple(sorted(self._names))
        kind = number % 7
        if kind == 0:
            return Case({FILE: damaged_bytes(random, text.encode())}, how="bytes")
        if kind == 1:
            return self._case("lines", damaged_lines(random, text, self._everything))
        if kind == 2:
            return self._case("tokens", damaged_tokens(random, text))
        if kind == 3:
            return self._case("names", damaged_tokens(random, text, names))
        if kind == 4:
            return self._case("structure", _restructured(random, text))
        if kind == 5:
            return self._case("numbers", _renumbered(random, text))
        mixed = damaged_tokens(random, damaged_lines(random, text, self._everything), names)
        return self._case("mixed", _renumbered(random, mixed))

    @staticmethod
    def _case(how: str, text: str) -> Case:
        return Case({FILE: text.encode("utf-8", "surrogatepass")}, how=how)

    def judged(self, case: Case, folder: Path) -> Outcome:
        deck = load_deck(folder / FILE)
        problems = deck_problems(deck)
        try:
            assembly = declare(deck)
        except NlsError:
            if not problems:
                return Outcome("traceback", "declare refuses what has no problem")
            raise
        if problems:
            return Outcome("traceback", "declare accepts what has problems")
        written = deck_text(assembly)
        again = declare(read_deck(written, Path("again.toml")))
        if deck_text(again) != written or again.quantities() != assembly.quantities():
            return Outcome("read back differently", "deck")
        model = flatten(assembly)
        if flatten(again).values != model.values:
            return Outcome("read back differently", "model")
        return Outcome(ACCEPTED)


def _renumbered(chance: random.Random, text: str) -> str:
    """Return a deck with other values, units and spreads."""
    for _ in range(chance.choice((1, 1, 2, 3))):
        pattern, words, pool = chance.choice((
            (_VALUE, "value = {}", EVIL_NUMBERS),
            (_UNIT, 'unit = "{}"', EVIL_UNITS),
            (_SPREAD, "spread = {}", EVIL_NUMBERS),
        ))  # fmt: skip
        matches = list(pattern.finditer(text))
        if not matches:
            continue
        match = chance.choice(matches)
        new = words.replace("{}", _number(chance) if chance.random() < 0.4 and pool is EVIL_NUMBERS
                            else chance.choice(pool))  # fmt: skip
        text = text[: match.start()] + new + text[match.end() :]
        if pattern is _VALUE and chance.random() < 0.3:
            unit = f'unit = "{chance.choice(EVIL_UNITS)}"'
            head, tail = text[: match.start()], text[match.start() :]
            text = head + _UNIT.sub(unit.replace("\\", r"\\"), tail, count=1)
    return text


def _number(chance: random.Random) -> str:
    """Return a number of any size, or a row of such numbers."""
    numbers = [
        f"{chance.uniform(-1, 1) * 10.0 ** chance.randint(-12, 12):.4g}"
        for _ in range(chance.choice((1, 1, 3)))
    ]
    return numbers[0] if len(numbers) == 1 else f"[{', '.join(numbers)}]"


def _restructured(chance: random.Random, text: str) -> str:
    """Return a deck with deep nesting, dotted keys, tables of other kinds, or parts put elsewhere."""
    headers = [m[0] for m in re.finditer(r"^\[[^\]\n]+\]", text, re.MULTILINE)]
    depth = chance.choice((2, 10, 60, 300, 900, 3000, 20000))
    kind = chance.randrange(12)
    if kind == 0:
        return f"{text}\nx = {'[' * depth}{']' * depth}\n"
    if kind == 1:
        return f"{text}\n[{'.'.join(['a'] * depth)}]\nx = 1\n"
    if kind == 2:
        return f"{'.'.join(['a'] * depth)} = 1\n{text}"
    if kind == 3:
        return f"{text}\nx = {'{a = ' * depth}1{'}' * depth}\n"
    if kind == 4:
        depth = min(depth, 1500)
        law = chance.choice(("Series", "Parallel", "Through", "TwoSidedCam", "Free"))
        nested = "".join(f'\n[n{".m" * level}]\ncomponent = "{law}"\n' for level in range(depth))
        return f"{text}{nested}"
    if kind == 5:
        header = chance.choice(headers)
        return text.replace(header, f"[{header}]", 1)
    if kind == 6:
        one, other = chance.choice(headers), chance.choice(headers)
        return text.replace(one, other[:-1] + "." + one[1:], 1)
    if kind == 7:
        one = chance.choice(headers)
        return text.replace(one, f"[{one[1:-1]}.{chance.choice(EVIL_TEXTS) or 'x'}]", 1)
    if kind == 8:
        return text.replace(chance.choice(headers), f'["{chance.choice(EVIL_TEXTS)}"]', 1)
    if kind == 9:
        line = chance.choice([each for each in text.split("\n") if " = " in each])
        key, _, value = line.partition(" = ")
        ways = (f"{key}.x = {value}", f'"{key}" = {value}', f"{key} = [{value}]", f"{key} = {{x = {value}}}")
        return text.replace(line, chance.choice((*ways, f"{line}\n{line}")), 1)
    if kind == 10:
        parent = f'parent = {{name = "x", digest = "{"0" * 64}", parent = ' * min(depth, 400)
        return text.replace(
            "[deck]", f'[deck]\n{parent}{{name = "x", digest = "{"0" * 64}"}}{"}" * min(depth, 400)}', 1
        )
    copies = "".join(re.sub(r"^\[", f"[copy{n}.", text, flags=re.MULTILINE) for n in range(min(depth, 20)))
    return f"{text}\n{copies}"
