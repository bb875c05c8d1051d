"""Formulas as docstrings write them (``T = T_c·tanh(ω/ω_s)``), found in prose and turned into MathML."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from html import escape

_RELATIONS = set("=≤≥≠≡≈<>≻∝")
_SIGNS = {"+", "−", "-", "·", "×", "→", "/", "±"}
_FUNCTIONS = {"sin", "cos", "tan", "tanh", "asin", "atan", "ln", "log", "exp", "sgn", "min", "max", "round"}
_FUNCTIONS |= {"sinh", "cosh", "arg", "det", "Re", "Im"}
_SIGNALS = {"goal", "memory", "reading", "value", "gain", "bias"}
_LOWERED = dict(zip("₀₁₂₃₄₅₆₇₈₉ᵢⱼₖₙₜₓ₋₊", "0123456789ijkntx−+", strict=True))
_RAISED = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹ⁱⁿᵀ⁺⁻ᵅ", "0123456789inT+−α", strict=True))
_OPENING, _CLOSING = "([{⟨⌊", ")]}⟩⌋"
_MARKS = {"\u0307": "˙", "\u0308": "¨", "\u0302": "^", "\u0304": "¯"}
_CHUNK = re.compile(r"^[\w\s()\[\]{}⟨⟩|·×/^_+−\-±=≤≥≠≡≈<>≻∝√∞∫Σ∂°%,.;:'*⁺⁻ᵀ→\u0300-\u036f]+$")
_TOKEN = re.compile(
    r"(?P<number>\d+(?:\.\d+)?(?:e-?\d+)?)|(?P<word>[^\W\d_](?:[\u0300-\u036f])*)|(?P<space>\s+)|(?P<other>.)",
    re.S,
)


def typeset(text: str) -> str:
    """Return prose as HTML in which formulas and symbols are typeset; all else is escaped.

    Parameters
    ----------
    text
        One paragraph without markup.
    """
    chunks = _chunks(text)
    shown: list[str] = []
    while chunks:
        count = _formula_length(chunks)
        if count:
            run = " ".join(chunks[:count])
            core = run.rstrip(",.;:")
            core = run if _unbalanced(core) else core
            shown.append(mathml(core) + escape(run[len(core) :]))
        else:
            count = 1
            shown.append(_chunk(chunks[0]))
        chunks = chunks[count:]
    return " ".join(shown)


def formulas(text: str) -> list[str]:
    """Return the formulas of a paragraph: runs of terms with a relation between them.

    Parameters
    ----------
    text
        One paragraph without markup.
    """
    chunks, result = _chunks(text), []
    while chunks:
        count = _formula_length(chunks)
        if count:
            result.append(" ".join(chunks[:count]).rstrip(",.;:"))
        chunks = chunks[max(count, 1) :]
    return result


def mathml(formula: str, *, block: bool = False) -> str:
    """Return a formula as a ``math`` element.

    Parameters
    ----------
    formula
        In the notation of docstrings.
    block
        Whether it stands on a line of its own.
    """
    inner = _Reader(_decomposed(formula)).row("")
    kind = ' display="block"' if block else ""
    return f'<math xmlns="http://www.w3.org/1998/Math/MathML"{kind}>{inner}</math>'


def _decomposed(text: str) -> str:
    """Return text with the marks above letters as characters of their own; signs such as ≠ stay whole."""
    return "".join(unicodedata.normalize("NFD", c) if c.isalpha() else c for c in text)


def _chunks(text: str) -> list[str]:
    """Return what spaces separate, a pair of brackets with its content in one."""
    chunks: list[str] = []
    depth, begun = 0, False
    for part in text.split():
        if begun and depth > 0:
            chunks[-1] += " " + part
        else:
            chunks.append(part)
            begun = True
        depth = max(0, depth + sum(c in "([{⟨" for c in part) - sum(c in ")]}⟩" for c in part))
    return chunks


def _formula_length(chunks: list[str]) -> int:
    """Return how many chunks from the first on are one formula; 0 where none begins."""
    if not _operand(chunks[0]) or chunks[0][-1] in ",.;:":
        return 0
    length, relation = 1, False
    while length < len(chunks) and chunks[length - 1][-1] not in ",.;:":
        if _open(chunks[length - 1]) and _operand(chunks[length]):
            length += 1
        elif chunks[length] in _RELATIONS | _SIGNS and _operand(" ".join(chunks[length + 1 : length + 2])):
            relation |= chunks[length] in _RELATIONS
            length += 2
        else:
            break
    return length if relation else 0


def _open(chunk: str) -> bool:
    """Whether a sum, an integral or a function without brackets goes on in the next chunk."""
    return chunk[-1] == "Σ" or "∫" in chunk or re.sub(r"[₀-₉]", "", chunk) in _FUNCTIONS


def _operand(chunk: str) -> bool:
    core = chunk.rstrip(",.;:")
    if not core or not _CHUNK.match(_decomposed(core)) or _unbalanced(core):
        return False
    words = re.findall(r"[A-Za-z]{3,}", re.sub(r"_(\w+|\(.*?\)|\{.*?\})", "", core))
    longer = [word for word in words if word not in _FUNCTIONS | _SIGNALS]
    return not longer or re.fullmatch(r"[a-z]+(\([^ ]*\))?", core) is not None


def _unbalanced(text: str) -> bool:
    return any(text.count(a) != text.count(b) for a, b in zip("([{⟨", ")]}⟩", strict=True))


def _chunk(chunk: str) -> str:
    """Return one chunk of prose, typeset where it is a symbol."""
    core = chunk.strip(",.;:")
    symbol = re.search(r"[α-ωΑ-Ωµ₀-₉ᵢⱼₖₙₜ⟨√∫Σ]|_\w|\^|[\u0300-\u036f]", _decomposed(core))
    if not symbol or not _operand(core) or _unbalanced(core):
        return escape(chunk)
    before, after = chunk[: chunk.index(core)], chunk[chunk.index(core) + len(core) :]
    return escape(before) + mathml(core) + escape(after)


class _Reader:
    """Reads a formula from left to right.

    Parameters
    ----------
    text
        Decomposed, so that dots above letters are characters of their own.
    """

    def __init__(self, text: str) -> None:
        self.tokens = [
            (m.lastgroup or "", m.group()) for m in _TOKEN.finditer(text) if m.lastgroup != "space"
        ]
        self.place = 0

    def row(self, end: str) -> str:
        """Return everything up to a closing bracket, with fractions of single terms built."""
        parts: list[str] = []
        while self.place < len(self.tokens):
            if end and self.tokens[self.place][1] == end:
                self.place += 1
                break
            parts.append(self.term())
        return "<mrow>" + "".join(parts) + "</mrow>"

    def term(self) -> str:
        """Return one symbol, number or bracket with what is set below and above it."""
        base, lowered, raised = self.atom(), "", ""
        while self.place < len(self.tokens):
            sign = self.tokens[self.place][1]
            if sign == "_" and not lowered:
                self.place += 1
                lowered = self.script(word=True)
            elif sign == "^" and not raised:
                self.place += 1
                raised = self.script(word=False)
            elif sign in _LOWERED and not lowered:
                lowered = self.small(_LOWERED)
            elif sign in _RAISED and not raised:
                raised = self.small(_RAISED)
            else:
                break
        if lowered and raised:
            return f"<msubsup>{base}{lowered}{raised}</msubsup>"
        if lowered:
            return f"<msub>{base}{lowered}</msub>"
        return f"<msup>{base}{raised}</msup>" if raised else base

    def small(self, table: dict[str, str]) -> str:
        """Return a run of small characters."""
        run = ""
        while self.place < len(self.tokens) and self.tokens[self.place][1] in table:
            run += table[self.tokens[self.place][1]]
            self.place += 1
        return f"<mi>{run}</mi>" if run.isalpha() else f"<mn>{run}</mn>"

    def script(self, *, word: bool) -> str:
        """Return what is set below or above: a bracket, or a sign and a name."""
        if self.place >= len(self.tokens):
            return "<mrow></mrow>"
        if self.tokens[self.place][1] in "({":
            end = ")" if self.tokens[self.place][1] == "(" else "}"
            self.place += 1
            return self.row(end)
        sign = ""
        if self.tokens[self.place][1] in "−-+":
            sign = f"<mo>{self.tokens[self.place][1]}</mo>"
            self.place += 1
        if not word:
            return f"<mrow>{sign}{self.atom()}</mrow>"
        run = ""
        while self.place < len(self.tokens) and self.tokens[self.place][0] in {"word", "number"}:
            if run and self.tokens[self.place][1] in _LOWERED:
                break
            run += self.tokens[self.place][1]
            self.place += 1
        return f"<mtext>{escape(run)}</mtext>" if len(run) > 1 else f"<mi>{escape(run)}</mi>"

    def atom(self) -> str:
        """Return one symbol, number, function, root or bracket."""
        kind, text = self.tokens[self.place]
        name = self.name()
        if name:
            self.place += len(name)
            return f'<mi mathvariant="normal">{name}</mi>'
        self.place += 1
        if kind == "number":
            return f"<mn>{text}</mn>"
        if kind == "word":
            mark = next((m for m in text[1:] if m in _MARKS), "")
            symbol = f"<mi>{text[0] if mark else text}</mi>"
            return f'<mover accent="true">{symbol}<mo>{_MARKS[mark]}</mo></mover>' if mark else symbol
        if text == "√":
            inner = self._bracketed(self.atom)
            return f"<msqrt>{inner}</msqrt>"
        if text in _OPENING:
            end = _CLOSING[_OPENING.index(text)]
            inner = self.row(end)
            return f"<mrow>{_sign(text)}{inner}{_sign(end)}</mrow>"
        if text in _LOWERED or text in _RAISED:
            return f"<mn>{_LOWERED.get(text) or _RAISED[text]}</mn>"
        return _sign(text)

    def _bracketed(self, otherwise: Callable[[], str]) -> str:
        if self.place < len(self.tokens) and self.tokens[self.place][1] == "(":
            self.place += 1
            return self.row(")")
        return otherwise() if self.place < len(self.tokens) else ""

    def name(self) -> str:
        """Return the name of a function or of a signal that begins here; empty where it is a letter."""
        run = ""
        for kind, text in self.tokens[self.place :]:
            if kind != "word" or not text.isascii():
                break
            run += text
        if run in _FUNCTIONS or len(run) > 3:
            return run
        return next((f for f in sorted(_FUNCTIONS, key=len, reverse=True) if run.startswith(f)), "")


def _sign(text: str) -> str:
    # As entities: brackets, bars and stars mean something else to Markdown.
    shown = f"&#{ord(text)};" if text in "()[]{}|*_<>&" else text
    stretched = ' stretchy="false"' if text in "()[]{}⟨⟩|" else ""
    return f"<mo{stretched}>{shown}</mo>"
