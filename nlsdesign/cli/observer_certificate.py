"""``nlsdesign observer --certificate`` and ``observer verify``: what is proved, and checked again."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .output import json_option, show_json

if TYPE_CHECKING:
    from ..deck import Deck
    from ..model import FlatModel

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


def write_certified(
    plant: FlatModel, deck: Deck, out: Path, *, sample_time: float, wanted: ToProve, **roles: str | None
) -> None:
    """Write an observer as C, with a certificate beside it.

    Parameters
    ----------
    plant, deck
        Flat model of an actuator, and its deck.
    out
        Folder.
    sample_time
        In s.
    wanted
        What is to be proved.
    roles
        ``spring`` and ``measured``, where the structure leaves them open.
    """
    from ..export import export_c
    from ..model.roles import measured_motion, series_spring
    from ..observer import CertifiedGain, certify, declared_assumptions, write_certificate
    from ..observer.scheduling.scheduled import design_observer_with_details

    design = design_observer_with_details(
        plant, estimate=series_spring(plant, roles.get("spring")).effort,
        measured=measured_motion(plant, roles.get("measured")),
        sample_time=sample_time, gain=None if wanted.decay is None else CertifiedGain(decay=wanted.decay),
    )  # fmt: skip
    spreads = {v.name: v.spread for v in plant.parameters if v.spread > 0.0} if wanted.with_spread else {}
    assumed = replace(declared_assumptions(plant, design), spreads=spreads, real=wanted.real)
    text = deck.path.read_text(encoding="utf-8-sig")
    proved = certify(plant, design, assumptions=assumed, decay=wanted.decay, deck=(deck.name, text))
    source = export_c(design.model, out, real=wanted.real, name="observer")
    proved = replace(proved, code=_hashes(source.header, source.source))
    path = write_certificate(proved, out / CERTIFICATE)
    for sentence in proved.statement:
        click.echo(sentence)
    click.echo(f"written: {path}, {source.header}, {source.source}, {source.selftest}")


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
