"""``nlsdesign observer --certificate`` and ``observer verify``: what is proved, and checked again."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import ArrangementError
from .output import json_option, show_json

if TYPE_CHECKING:
    from ..deck import Deck
    from ..export import CSource
    from ..model import FlatModel
    from ..observer import Certificate
    from .observer_kinds import DesignedObserver

CERTIFICATE = "certificate.json"


@dataclass(frozen=True)
class ToProve:
    """What is to be proved of an observer.

    Parameters
    ----------
    decay
        Of one certified gain in 1/s; the default gain is certified without it.
    with_spread
        Whether parameters may be anywhere within their spread.
    real
        ``"double"`` or ``"float"``.
    """

    decay: float | None
    with_spread: bool
    real: str


def prove(plant: FlatModel, deck: Deck, chosen: DesignedObserver, wanted: ToProve) -> Certificate:
    """Prove what can be proved of an observer.

    Parameters
    ----------
    plant, deck
        Flat model of an actuator, and its deck.
    chosen
        Cascade or certified gain.
    wanted
        What is to be proved.

    Raises
    ------
    ArrangementError
        If observers of that kind cannot be certified.
    """
    from ..observer import ObserverDesign, certify, declared_assumptions

    design = chosen.design
    if not isinstance(design, ObserverDesign):
        raise ArrangementError(
            f"observer of kind '{chosen.kind}'", "cannot be certified", next_step="take --kind certified"
        )
    spreads = {v.name: v.spread for v in plant.parameters if v.spread > 0.0} if wanted.with_spread else {}
    assumed = replace(declared_assumptions(plant, design), spreads=spreads, real=wanted.real)
    text = deck.path.read_text(encoding="utf-8-sig")
    return certify(plant, design, assumptions=assumed, decay=wanted.decay, deck=(deck.name, text))


def with_statement(observer: FlatModel, proved: Certificate) -> FlatModel:
    """Return an observer whose description, and so the head of its C code, ends with what is proved.

    Parameters
    ----------
    observer
        As designed.
    proved
        Its certificate.
    """
    words = " ".join(proved.statement)
    return replace(observer, description=f"{observer.description}; certified, see {CERTIFICATE}: {words}")


def write_proved(proved: Certificate, out: Path, source: CSource) -> Path:
    """Write the certificate beside the C code, with the hashes of both files.

    Parameters
    ----------
    proved
        Without the hashes.
    out
        Folder.
    source
        The C code.
    """
    from ..observer import write_certificate

    return write_certificate(replace(proved, code=_hashes(source.header, source.source)), out / CERTIFICATE)


def _hashes(*files: Path) -> dict[str, str]:
    from ..observer.certificates.certificate import hashes_of_code

    (folder,) = {file.parent for file in files}
    result = hashes_of_code(folder)
    return {file.name: result[file.name] for file in files}


@click.command("verify")
@click.argument("certificate", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--deck", "deck_name", metavar="DECK", help="Deck that should be the certified one.")
@click.option(
    "--c", "code", type=click.Path(path_type=Path, file_okay=False), help="Folder of the C files to compare."
)
@json_option
def verify_certificate(certificate: Path, deck_name: str | None, code: Path | None, as_json: bool) -> None:
    """Check a certificate again, without the solver; exit status 1 where it does not hold."""
    from ..components.assembly.deck_writer import declare
    from ..deck import load_deck, read_deck
    from ..model import flatten
    from ..observer import read_certificate, verify

    proved, untouched = read_certificate(certificate)
    given = load_deck(deck_name).path.read_text(encoding="utf-8-sig") if deck_name else None
    name, text = proved.deck
    model = flatten(declare(read_deck(text, Path(f"{name}.toml")))) if text else None
    result = verify(proved, untouched=untouched, model=model, deck=given, code=code)
    if as_json:
        checks = [{"name": c.name, "holds": c.holds, "detail": c.detail} for c in result.checks]
        show_json({"holds": result.holds, "statement": list(proved.statement), "checks": checks})
    else:
        for sentence in proved.statement:
            click.echo(sentence)
        click.echo(str(result))
        click.echo("the certificate holds" if result.holds else "the certificate DOES NOT HOLD")
    if not result.holds:
        sys.exit(1)
