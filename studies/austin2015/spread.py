"""What the spread of the deck does to the torque observers, and what is proved of one of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.export import CSource, natively
from nlsdesign.feedback.analysis import RankDrops, rank_drops
from nlsdesign.feedback.observer import (
    Certificate,
    CertifiedGain,
    Contraction,
    ObserverOfChoice,
    SpreadErrors,
    certify,
    choose_observer,
    declared_assumptions,
    observer_bench,
    observer_errors,
)
from nlsdesign.feedback.observer.certificates.certificate import hashes_of_code

from .observer import ObserverComparison


@dataclass(frozen=True, eq=False)
class Proved:
    """Certificate of one gain for all angles, its file, and the C code that it is about."""

    certificate: Certificate[Contraction]
    code: CSource
    file: Path

    @property
    def hashes(self) -> str:
        """SHA-256 of the certified C files by name, as the certificate has them."""
        digests = hashes_of_code(self.code.source.parent)
        files = sorted(path.name for path in (self.code.header, self.code.source))
        return "\n".join(f"{file}: SHA-256 {digests[file]}" for file in files)


@dataclass(frozen=True, eq=False)
class ObserverOverSpread:
    """The observer that is generated, its errors over the spread, and the certified one beside it.

    Parameters
    ----------
    chosen
        Least expected error over the spread.
    errors
        Of ``best``, ``cascade`` and ``published form`` on one bench.
    drops
        Angles at which a state is not seen.
    proved
        What is proved of one gain for all angles.
    """

    chosen: ObserverOfChoice
    errors: SpreadErrors
    drops: RankDrops
    proved: Proved


def over_spread(
    model: nls.FlatModel, observers: ObserverComparison, draws: int, *, proved: Proved
) -> ObserverOverSpread:
    """Compare the observers over the spread of a deck."""
    chosen = choose_observer(model)
    compared = {
        "best": chosen.model, "cascade": observers.minimal.model, "published form": observers.published.model,
    }  # fmt: skip
    errors = observer_errors(
        compared, observer_bench(model), draws=draws, bounded=0 if draws < 8 else 2, translate=natively
    )
    angles = np.radians(np.linspace(-50.0, 50.0, 101))
    drops = rank_drops(model, angles=angles, angle="motor.angle", measured=("motor.angle",))
    return ObserverOverSpread(chosen, errors, drops, proved)


def certified(model: nls.FlatModel, deck: Path, out: Path) -> Proved:
    """Certify one gain for all angles, and write the certificate beside its code."""
    design = nls.observer.design_observer_with_details(model, gain=CertifiedGain())
    text = deck.read_text(encoding="utf-8")
    proved = certify(model, design, assumptions=declared_assumptions(model, design), deck=(deck.stem, text))
    real = proved.proof.assumptions.real
    code = nls.export_c(proved.stated(design.model), out / "certified", name="observer", real=real)
    return Proved(proved, code, proved.write_beside(code.header, code.source))
