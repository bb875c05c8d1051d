"""What a law, an effect, a deck or a material cites is in the bibliography, and nothing else is."""

from __future__ import annotations

import ast
import functools
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from nlsdesign.bench.discrepancy.effects import ALL
from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.foundation.bibliography import Reference, cited, origins, references
from nlsdesign.foundation.deck import deck_names, load_deck
from tests import source

YEAR = re.compile(r"(?<![\w.])(?:1[6-9]\d\d|20[0-2]\d)(?!\w|\.\d)")
SENTENCE = re.compile(r"\bSources?:\s+(.*?)(?:\n\s*\n|\Z)", flags=re.DOTALL)


@functools.cache
def beginning() -> re.Pattern[str]:
    """What a source may begin with."""
    return re.compile(rf"(?:{'|'.join(map(re.escape, [*references(), *origins()]))})(?!\w)")


def unresolved(sentence: str) -> Iterator[str]:
    """Yield the sources in a sentence, parted by semicolons, that are no publication and no origin."""
    for piece in re.split(r";\s+", " ".join(sentence.split()).rstrip(".")):
        if not beginning().match(piece):
            yield piece
            continue
        for reference in cited(piece):
            piece = piece.replace(reference.key, "")
        if YEAR.search(piece):
            yield piece.strip()


def docstring_sources(file: Path) -> Iterator[tuple[str, str]]:
    """Place and text of each sentence in a docstring that begins with ``Source:``."""
    # To parse all files takes seconds, and four of five name no source.
    named = SENTENCE.search(file.read_text(encoding="utf-8"))
    for node in ast.walk(source.parse(file)) if named else ():
        if isinstance(node, source.Function | ast.ClassDef | ast.Module):
            for text in SENTENCE.findall(ast.get_docstring(node) or ""):
                yield f"{file.name}: {getattr(node, 'name', 'module')}", text


def family(reference: Reference) -> str:
    return reference.authors[0].partition(",")[0].partition(" (")[0]


def loosely_cited(text: str) -> Iterator[Reference | str]:
    """Yield the publication for each year in the source of a number; where there is none, the text before."""
    end = 0
    for year in YEAR.finditer(text):
        before, end = text[end : year.start()], year.end()
        fits = [r for r in references().values() if r.year == int(year[0]) and family(r) in before]
        yield fits[0] if fits else before + year[0]


def sources_of_numbers(table: Any) -> Iterator[str]:
    """Every value under the key ``source`` in a table of TOML."""
    if isinstance(table, dict):
        if isinstance(table.get("source"), str):
            yield table["source"]
        for inner in table.values():
            yield from sources_of_numbers(inner)
    elif isinstance(table, list):
        for inner in table:
            yield from sources_of_numbers(inner)


@pytest.fixture(scope="module")
def documented(root: Path) -> dict[str, str]:
    files = [file for folder in ("nlsdesign", "models", "studies") for file in (root / folder).rglob("*.py")]
    found = {f"{place}, {n}": s for f in files for n, (place, s) in enumerate(docstring_sources(f))}
    assert len(found) > 60
    return found


@pytest.fixture(scope="module")
def of_effects(root: Path) -> dict[str, str]:
    """Sources of the effects on every deck, and all texts in their files that have a year."""
    machines = [declare(load_deck(name)) for name in deck_names()]
    named = {
        candidate.effect: candidate.source
        for machine in machines
        for effect in ALL
        for candidate in effect(machine)
    }
    assert len(named) >= 15
    for file in (root / "nlsdesign" / "bench" / "discrepancy" / "effects").rglob("*.py"):
        for node in ast.walk(source.parse(file)):
            text = node.value if isinstance(node, ast.Constant) else None
            if isinstance(text, str) and "\n" not in text and YEAR.search(text):
                named[f"{file.name}, line {node.lineno}"] = text
    return named


@pytest.fixture(scope="module")
def of_numbers(root: Path) -> dict[str, str]:
    files = [*(root / "models" / "decks").glob("*.toml"), root / "models" / "materials.toml"]
    return {
        f"{file.name}, {n}": text
        for file in files
        for n, text in enumerate(sources_of_numbers(tomllib.loads(file.read_text(encoding="utf-8"))))
    }


def test_the_sources_of_all_laws_resolve(documented: dict[str, str]) -> None:
    assert not {place: wrong for place, text in documented.items() if (wrong := list(unresolved(text)))}


def test_the_sources_of_all_effects_resolve(of_effects: dict[str, str]) -> None:
    assert not {place: wrong for place, text in of_effects.items() if (wrong := list(unresolved(text)))}


def test_the_publications_behind_numbers_resolve(of_numbers: dict[str, str]) -> None:
    found = {place: list(loosely_cited(text)) for place, text in of_numbers.items()}
    assert sum(map(len, found.values())) > 20
    assert not {place: words for place, words in found.items() if any(isinstance(w, str) for w in words)}


def test_every_entry_is_cited(
    documented: dict[str, str], of_effects: dict[str, str], of_numbers: dict[str, str]
) -> None:
    texts = [*documented.values(), *of_effects.values()]
    used = {reference.key for text in texts for reference in cited(text)}
    used |= {r.key for text in of_numbers.values() for r in loosely_cited(text) if isinstance(r, Reference)}
    idle = sorted(set(references()) - used)
    assert not idle, "nobody cites these"
    pieces = [piece for text in texts for piece in re.split(r";\s+", " ".join(text.split()))]
    idle = [origin for origin in origins() if not any(piece.startswith(origin) for piece in pieces)]
    assert not idle, "nothing comes from there"


def test_entries_are_whole() -> None:
    for key, entry in references().items():
        assert entry.title
        assert entry.published
        names = [author.partition(",")[0].partition(" (")[0] for author in entry.authors]
        who = (
            names[0] if len(names) == 1 else " and ".join(names) if len(names) == 2 else f"{names[0]} et al."
        )
        assert key == (f"{who} {entry.year}" if entry.year else f"{who} {entry.number}")
        assert not entry.doi or re.fullmatch(r"10\.\d{4,9}/\S+", entry.doi)
        assert str(entry).startswith("; ".join(entry.authors))
    identifiers = [entry.doi for entry in references().values() if entry.doi]
    assert len(identifiers) == len(set(identifiers))


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("Yeoh 1993.", []),
        ("virtual work, T·dθ = F·dδ; Austin et al.\n    2015, eq. (4), without N.", []),
        ("Stribeck 1902; Armstrong-Hélouvry 1991 (this form).", []),
        ("Yeo 1993", ["Yeo 1993"]),
        ("Yeoh 1994", ["Yeoh 1994"]),
        ("any text on electric drives", ["any text on electric drives"]),
        ("Yeoh 1993; the usual model", ["the usual model"]),
        ("Euler 1769, Eytelwein 1809", [", Eytelwein 1809"]),
    ],
)
def test_a_source_that_does_not_resolve_is_caught(text: str, wrong: list[str]) -> None:
    assert list(unresolved(text)) == wrong


def test_a_year_without_a_publication_is_caught() -> None:
    (found,) = loosely_cited("Treloar, Trans. Faraday Soc. 40, 1944, within 12 %")
    assert found == references()["Treloar 1944"]
    assert list(loosely_cited("Treloar 1945")) == ["Treloar 1945"]
    assert list(loosely_cited("assumed: 8192 counts, knots at 0.1944 and 1.0 m")) == []


def test_references_are_found_in_the_order_of_citation() -> None:
    found = cited("Source: Yeoh 1993; as printed by Arruda\n and Boyce 1993, unlike Treloar 19751.")
    assert [reference.key for reference in found] == ["Yeoh 1993", "Arruda and Boyce 1993"]
    assert str(found[0]).endswith("https://doi.org/10.5254/1.3538343")
