"""``observer certify-continuous`` and ``observer certify-adaptive``: proofs beside those of sampled gains."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .observer_certificate import CERTIFICATE, given_ranges, range_options
from .output import DECK_HELP, examples, json_option, measured_option, show_written, spring_option
from .overwriting import c_names, out_option
from .units import Number

if TYPE_CHECKING:
    from ..foundation.deck import Deck
    from ..model import FlatModel

deck_option = click.option("--deck", "deck_name", metavar="DECK", required=True, help=DECK_HELP)


def _plant(deck_name: str) -> tuple[Deck, tuple[str, str], FlatModel]:
    from ..components.assembly.deck_writer import declare
    from ..foundation.deck import load_deck
    from ..model import flatten

    deck = load_deck(deck_name)
    return deck, (deck.name, deck.path.read_text(encoding="utf-8-sig")), flatten(declare(deck))


def _roles(plant: FlatModel, options: dict[str, Any]) -> dict[str, str]:
    from ..model.roles import measured_motion, series_spring

    return {
        "estimate": series_spring(plant, options["spring"]).effort,
        "measured": measured_motion(plant, options["measured"]),
    }


@click.command(
    "certify-continuous",
    epilog=examples(
        "nlsdesign observer certify-continuous --deck austin2015_figure_consistent",
        "nlsdesign observer certify-continuous --deck austin2015_figure_consistent --published "
        "--angles '-40 deg' '40 deg'",
    ),
)
@deck_option
@spring_option
@measured_option
@out_option("out/observer", writes=(CERTIFICATE,))
@click.option("--published", is_flag=True, help="States of Austin et al. 2015 instead of the minimal ones.")
@click.option("--decay", type=float, metavar="PER_SECOND", help="As fast as can be proved by default.")
@click.option("--condition", type=float, default=100.0, show_default=True, help="Largest condition of P.")
@click.option(
    "--angles", type=Number("rad"), nargs=2, metavar="LOW HIGH", help="The whole contour by default."
)
@json_option
def certify_continuous_gain(
    deck_name: str,
    out: Path,
    published: bool,
    angles: tuple[float, float] | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Design one gain in continuous time with the proof that every error vanishes."""
    from ..feedback.observer import Minimal, PaperForm, certify_continuous, write_certificate

    _, text, plant = _plant(deck_name)
    proved = certify_continuous(
        plant, **_roles(plant, options), form=PaperForm() if published else Minimal(),
        decay=options["decay"], condition=options["condition"], angles=angles,
    )  # fmt: skip
    proved = replace(proved, deck=text)
    path = write_certificate(proved, out / CERTIFICATE)
    gains = dict(zip(proved.proof.system.states, proved.proof.gain, strict=True))
    rows = [f"gain of {name}: {', '.join(f'{v:.7g}' for v in row)}" for name, row in gains.items()]
    show_written(as_json, (*proved.statement, *rows), [path], gains=gains)


@click.command(
    "certify-adaptive",
    epilog=examples(
        "nlsdesign observer certify-adaptive --deck austin2015_figure_consistent --out out/certified"
    ),
)
@deck_option
@click.option("--sample-time", type=Number("ms", above=0.0, up_to=1.0), default="1 ms", show_default=True,
              help="Of what is computed in steps.")  # fmt: skip
@spring_option
@measured_option
@out_option("out/observer", writes=(CERTIFICATE, *c_names("observer")))
@click.option("--real", type=click.Choice(["double", "float"]), default="double", show_default=True,
              help="Type of the numbers in C.")  # fmt: skip
@click.option("--limit", type=float, metavar="DEVIATIONS", help="Of the slow states; that of the adaptive "
              "observer by default.")  # fmt: skip
@range_options
@json_option
def certify_adaptive_estimate(
    deck_name: str,
    sample_time: float,
    out: Path,
    real: str,
    limit: float | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Write the adaptive observer as C, with a bound on how far its estimate can leave the deck's torque."""
    from ..export import export_c
    from ..feedback.observer import AdaptiveSettings, Trust, certify_held_estimate, design_adaptive_observer
    from ..feedback.observer.certificates.held_estimate import held_assumptions

    _, text, plant = _plant(deck_name)
    trust = Trust() if limit is None else Trust(limit=limit)
    roles = _roles(plant, options)
    design = design_adaptive_observer(
        plant, estimate=roles["estimate"], measured=roles["measured"], sample_time=sample_time,
        settings=AdaptiveSettings(trust=trust),
    )  # fmt: skip
    assumed = replace(held_assumptions(plant, design), real=real, **given_ranges(options))
    proved = certify_held_estimate(plant, design, assumptions=assumed, settings=asdict(trust), deck=text)
    source = export_c(proved.stated(design.model), out, real=real, name="observer")
    path = proved.write_beside(source.header, source.source)
    show_written(as_json, proved.statement, [path, source.header, source.source, source.selftest])
