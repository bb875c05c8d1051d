"""Ways to damage bytes and text."""

from __future__ import annotations

import random
import re

EVIL_NUMBERS = (
    "0", "-1", "0.0", "-0.0", "1e308", "-1e308", "1e-320", "1e309", "nan", "inf", "-inf",
    "9" * 400, "9" * 5000,
    "0." + "3" * 5000, "1e99999999", "-1e-99999999", "1e5000", "0x10", "0x" + "f" * 5000, "0b1", "1_000",
    "1__0", "+5", "1e", ".5",
    "5.", "true", "false", '"5"', "'text'", "[]", "[[1]]", "[1, 'a']", "[1, 2, 3]", "{}", "{value = 1}",
    "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "1e-12", "1e12", "\uff11\uff12", "\u0663",
    "1\u00a00", "",
)  # fmt: skip
EVIL_UNITS = (
    "Gg*m^2", "m^99", "m^-99", "m^9999999", "m^" + "9" * 5000, "", " ", "1", "%", "N*m/", "/", "*", "m//s",
    "kg" + "*kg" * 400, "GPa^40", "nm^40", "\u00b5m", "\u03bcm", "m\u00b2", "m\u207b\u00b9", "N\u00b7m",
    "mNm",
    "psi", "\u2126", "deg", "m^0", "m^-0", "1^5", "m^\u0663", "x" * 400, "N*m\n", "\x1b[31m",
)  # fmt: skip
EVIL_TEXTS = (
    "", " ", "x" * 5000, "\\u0000", "\\u001b[2J", "</script>", "../../etc", "a.b", "\\n", "\\\\",
    "\\U0001F600",
    "__class__", "int", "deck", "component", "value", "motor", "spring", "\u202e", "*/", "\x7f", "\u0130",
)  # fmt: skip
EVIL_BYTES = (
    b"\x00", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"\r", b"\r\n", b"\x1a", b"\x1b[2J", b"\xc3\x28", b"\x7f",
    b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\xe2\x80\xae", b"\t", b"\x0c", b"\xe2\x80\xa8",
)  # fmt: skip
_NUMBER = re.compile(r"(?<![\w.\"])[-+]?\d[\d.]*(?:[eE][-+]?\d+)?")
_STRING = re.compile(r"\"[^\"\n]*\"")
_NAME = re.compile(r"[A-Za-z_]\w*")


def damaged_bytes(chance: random.Random, content: bytes) -> bytes:
    """Return bytes that are flipped, cut, doubled, filled or mixed with odd ones."""
    for _ in range(chance.choice((1, 1, 2, 5, 20))):
        if not content:
            return bytes(chance.randrange(256) for _ in range(chance.randrange(64)))
        at = chance.randrange(len(content))
        length = min(len(content) - at, chance.choice((1, 1, 2, 4, 16, 64, 256, 4096)))
        kind = chance.randrange(8)
        if kind == 0:
            content = content[:at] + bytes([content[at] ^ (1 << chance.randrange(8))]) + content[at + 1 :]
        elif kind == 1:
            content = content[:at] + content[at + length :]
        elif kind == 2:
            content = content[:at] + content[at : at + length] * 2 + content[at + length :]
        elif kind == 3:
            content = content[:at]
        elif kind == 4:
            content = content[:at] + chance.choice(EVIL_BYTES) + content[at:]
        elif kind == 5:
            fill = chance.choice((b"\x00", b"\xff", b"\x80", b"\x7f"))
            content = content[:at] + fill * length + content[at + length :]
        elif kind == 6:
            content = (
                content[:at] + bytes(chance.randrange(256) for _ in range(length)) + content[at + length :]
            )
        else:
            other = chance.randrange(len(content))
            content = content[:at] + content[other : other + length] + content[at + length :]
    return content


def damaged_lines(chance: random.Random, text: str, others: str) -> str:
    """Return text with lines that are left out, doubled, moved, or taken from another text."""
    lines, foreign = text.split("\n"), others.split("\n")
    for _ in range(chance.choice((1, 1, 2, 3, 8))):
        at = chance.randrange(len(lines)) if lines else 0
        kind = chance.randrange(5)
        if kind == 0 and lines:
            del lines[at]
        elif kind == 1 and lines:
            lines.insert(chance.randrange(len(lines)), lines[at])
        elif kind == 2 and lines:
            lines.insert(chance.randrange(len(lines)), lines.pop(at))
        elif kind == 3:
            lines.insert(at, chance.choice(foreign))
        elif lines:
            line = lines[at]
            cut = chance.randrange(len(line) + 1)
            lines[at] = line[:cut]
    return "\n".join(lines)


def damaged_tokens(chance: random.Random, text: str, names: tuple[str, ...] = ()) -> str:
    """Return text in which numbers, texts or names are replaced."""
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        pattern, pool = chance.choice(
            ((_NUMBER, EVIL_NUMBERS), (_NUMBER, EVIL_NUMBERS), (_STRING, EVIL_TEXTS), (_NAME, EVIL_TEXTS))
        )
        matches = list(pattern.finditer(text))
        if not matches:
            continue
        match = chance.choice(matches)
        new = chance.choice(pool)
        if pattern is _STRING:
            new = f'"{new}"' if chance.random() < 0.7 else chance.choice(EVIL_NUMBERS)
        elif pattern is _NAME and (names or chance.random() < 0.5):
            new = chance.choice(names or tuple(m[0] for m in matches))
        text = text[: match.start()] + new + text[match.end() :]
    return text
