"""A real elastomer: what an elastic strip lacks, from tests at two rates of stretch, judged at a third.

Data: uniaxial loading and unloading of VHB 4910 at 0.01, 0.03 and 0.05 1/s up to a stretch of 3, published by
Chongran Zhao (VHB4910_data). They are read where they are and never copied.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.bench.discrepancy import Verdict
from nlsdesign.components import FlowingChains, NeoHooke
from nlsdesign.foundation.deck import Deck
from nlsdesign.presentation.report import TableSection, verdict_sections

from ._measured import data_folder, named_effects, write_diagnosis, write_skipped

MAPPING = Path(__file__).with_name("vhb4910_records.toml")
FORCE = "load_cell.reading"


@dataclass(frozen=True)
class StripError:
    """Rms error of the force in per cent of the rms force, on the fitted and on the held-out tests."""

    fit: float
    held_out: float


@dataclass(frozen=True, eq=False)
class Results:
    """Verdict, errors of both models, and numbers of the better one.

    Parameters
    ----------
    verdict
        Of the diagnosis of the elastic strip.
    elastic, better
        Errors of the elastic strip, refitted, and of the strip with the named effects.
    relaxation_times
        Of its branches, shortest first, in s.
    equilibrium_modulus
        Of its elastic law, in Pa.
    """

    verdict: Verdict
    elastic: StripError
    better: StripError
    relaxation_times: tuple[float, ...]
    equilibrium_modulus: float

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers by name."""
        times = {f"relaxation_time_{i}_s": time for i, time in enumerate(self.relaxation_times, start=1)}
        return {
            **named_effects(self.verdict),
            "elastic_error_fit_percent": self.elastic.fit,
            "elastic_error_held_out_percent": self.elastic.held_out,
            "better_error_fit_percent": self.better.fit,
            "better_error_held_out_percent": self.better.held_out,
            **times,
            "equilibrium_modulus_kPa": 1e-3 * self.equilibrium_modulus,
        }


def main(out: Path, fast: bool = False, data: Path | None = None) -> Results | None:
    """Diagnose the elastic strip with the tests at the slowest and the fastest rate.

    ``data``: folder that holds ``loading_unloading``; see :func:`data_folder`. Result: ``None`` where the
    measurements are not on this machine.
    """
    folder = data_folder("vhb4910", data)
    if folder is None:
        write_skipped("vhb4910", out)
        return None
    steps = nls.progress.Steps()
    strip = elastic_strip(nls.load_deck("vhb4910_specimen"))
    records = nls.load_records(folder / "loading_unloading", nls.flatten(strip), mapping=MAPPING)
    with steps.step("diagnosis"):
        verdict = nls.diagnose(strip, records, progress=steps.note)
    write_diagnosis(verdict, out)
    results = Results(
        verdict,
        strip_error(verdict.declared, records),
        strip_error(verdict.actuator, records),
        relaxation_times(verdict.actuator),
        next(q.number for name, q in verdict.actuator.quantities().items() if "elastic." in name),
    )
    rows = tuple((name.replace("_", " "), f"{value:.3g}") for name, value in results.numbers.items())
    nls.write_report(
        out / "report.html",
        *verdict_sections(verdict),
        TableSection("Numbers", ("quantity", "value"), rows, caption="Errors and what was fitted."),
        title="VHB 4910: what is missing",
    )
    return results


def elastic_strip(deck: Deck) -> nls.Assembly:
    """Return the strip of the deck with an elastic law alone, whose modulus is known to a factor of three."""
    declared = nls.models.elastomer_specimen(deck)
    size = {name: declared.quantities()[f"strip.rubber.{name}"] for name in ("area", "rest_length")}
    modulus = nls.quantity(40.0, "kPa", source="assumed: an order of magnitude", spread=2.0)
    rubber = nls.specimen(
        area=size["area"].with_spread(0.0),
        rest_length=size["rest_length"],
        elastic=NeoHooke(shear_modulus=modulus),
    )
    return declared.with_part("strip", rubber)


def strip_error(strip: nls.Assembly, records: nls.RecordSet) -> StripError:
    """Return the errors of a strip on the tests of the fit and on the held-out test."""

    def percent(tests: Sequence[nls.Record]) -> float:
        measured = [test.trace[FORCE] for test in tests]
        predicted = [nls.predict(strip, replace(records, records=(t,)), t.name)[FORCE] for t in tests]
        rest = np.concatenate(predicted) - np.concatenate(measured)
        return float(100.0 * np.linalg.norm(rest) / np.linalg.norm(np.concatenate(measured)))

    return StripError(percent(records.of("fit")), percent(records.of("held_out")))


def relaxation_times(strip: nls.Assembly) -> tuple[float, ...]:
    """Return viscosity over shear modulus of each branch that flows, shortest first."""
    branches = [part for _, part in strip.walk() if isinstance(part, FlowingChains)]
    return tuple(sorted(b.viscosity.number / b.shear_modulus.number for b in branches))
