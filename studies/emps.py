"""A real positioning drive: what its viscous model lacks, from one half of a record, judged on the other.

Data: Janot, Gautier, Brunot, "Data set and reference models of EMPS", Workshop on Nonlinear System
Identification Benchmarks, 2019. They are read where they are and never copied.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfiltfilt

import nlsdesign as nls
from nlsdesign.bench.discrepancy import Verdict, effects
from nlsdesign.bench.identification import Shots, Weights, coloured_sigma
from nlsdesign.presentation.report import PublishedNumber, TableSection, comparison_table, verdict_sections

from ._measured import data_folder, named_effects, write_diagnosis, write_skipped

MAPPING = Path(__file__).with_name("emps_records.toml")
SHORT, LONG = 1.0, 3.1  # s; windows of prediction
BANDWIDTH, EDGE = 20.0, 100  # Hz; samples that the filter spoils at each end
PHASES, FEW_PHASES = 4, 2  # of the windows of the fit
RIVALS = (effects.coulomb_friction, effects.constant_force, effects.viscous_friction, effects.quadratic_drag)
"""What the drive lacks, and what that is most easily mistaken for: enough for the fast way."""
MISSING = ("dry_friction", "offset")
FITTED = {
    "mass_kg": ("carriage.mass", "kg"),
    "viscous_Ns_per_m": ("guide.damping", "N*s/m"),
    "coulomb_N": ("dry_friction.sliding_effort", "N"),
    "offset_N": ("offset.load", "N"),
}
"""Claimed number: name of the parameter in the model, and unit."""


@dataclass(frozen=True)
class DriveError:
    """Error of a model on the half of the record that no fit has used.

    Parameters
    ----------
    short, long
        Rms error of the position over windows of 1 s and 3.1 s, in mm.
    force
        Rms error of the balance of forces in per cent of the rms force.
    """

    short: float
    long: float
    force: float

    def named(self, model: str) -> dict[str, float]:
        """Return the numbers by name, for instance of the model ``"viscous"``."""
        return {
            f"{model}_error_over_1s_mm": self.short,
            f"{model}_error_over_3s1_mm": self.long,
            f"{model}_force_error_percent": self.force,
        }


@dataclass(frozen=True, eq=False)
class Results:
    """Verdict, errors of both models, and numbers of the better one.

    Parameters
    ----------
    verdict
        Of the diagnosis of the drive with viscous friction alone.
    viscous, better
        Errors of that drive, refitted, and of the drive with the named effects.
    fitted, published
        Numbers of the better drive, and those of the data set, by the names of ``FITTED``.
    """

    verdict: Verdict
    viscous: DriveError
    better: DriveError
    fitted: dict[str, float]
    published: dict[str, float]

    @property
    def numbers(self) -> dict[str, float]:
        """The claimed numbers by name."""
        errors = self.viscous.named("viscous") | self.better.named("better")
        return named_effects(self.verdict) | errors | self.fitted


def main(out: Path, fast: bool = False, data: Path | None = None) -> Results | None:
    """Diagnose the drive without dry friction and offset, refit it with what is named, and judge both.

    ``data``: folder with ``emps.csv``; see :func:`data_folder`. Result: ``None`` where the measurements are
    not on this machine.
    """
    folder = data_folder("emps", data)
    if folder is None:
        write_skipped("emps", out)
        return None
    steps = nls.progress.Steps()
    published = nls.models.positioning_drive(nls.load_deck("janot2019_positioning_drive"))
    bare = viscous_only(published)
    records = nls.load_records(folder, nls.flatten(bare), mapping=MAPPING)
    with steps.step("diagnosis"):
        verdict = nls.diagnose(bare, records, catalogue=RIVALS if fast else None, progress=steps.note)
    with steps.step("fit by simulation, the balance of forces as prior"):
        better = refitted(verdict, records, FEW_PHASES if fast else PHASES)
    write_diagnosis(verdict, out)
    nls.write_deck(better, out / "refitted.toml")
    results = Results(
        verdict,
        drive_error(verdict.declared, records),
        drive_error(better, records),
        fitted_numbers(better),
        fitted_numbers(published),
    )
    write_page(results, out)
    return results


def viscous_only(published: nls.Assembly) -> nls.Assembly:
    """Return the drive with mass and viscous friction alone, known to a factor of three."""
    bare = published
    for name in MISSING:
        bare = bare.without_part(name)
    numbers, source = bare.quantities(), "assumed: an order of magnitude"
    guess = {"carriage.mass": 60.0, "guide.damping": 100.0}
    return bare.with_values(
        {name: numbers[name].with_value(v, source).with_spread(2.0) for name, v in guess.items()}
    )


def refitted(verdict: Verdict, records: nls.RecordSet, phases: int) -> nls.Assembly:
    """Return the better model, fitted by simulation over one second on top of the balance of forces."""
    model = nls.flatten(verdict.actuator)
    free = [nls.free_parameter(model.variable(p.name)) for fit in verdict.fits for p in fit.parameters]
    shots, train = Shots(SHORT, joined=False, phases=phases), records.of("fit")
    alone = nls.fit_by_simulation(model, train, free, shots=shots)
    weights = Weights(coloured_sigma(alone), known=verdict.fits)
    both = nls.fit_by_simulation(model, train, free, shots=shots, weights=weights)
    return verdict.actuator.with_values(both.fit.values)


def drive_error(drive: nls.Assembly, records: nls.RecordSet) -> DriveError:
    """Return the errors of a drive on the held-out half."""
    model, (record,) = nls.flatten(drive), records.of("held_out")
    short, long = (
        1e3 * nls.predict_in_windows(model, record, length).rmse("carriage.position")
        for length in (SHORT, LONG)
    )
    unbalanced = nls.predict(drive, records, record.name)["carriage.unbalanced"]
    force = model.values["carriage.force_constant"] * record.trace["carriage.voltage"]
    sections = butter(4, BANDWIDTH, fs=1.0 / record.step, output="sos")
    rest, whole = (sosfiltfilt(sections, signal)[EDGE:-EDGE] for signal in (unbalanced, force))
    return DriveError(short, long, float(100.0 * np.linalg.norm(rest) / np.linalg.norm(whole)))


def fitted_numbers(drive: nls.Assembly) -> dict[str, float]:
    """Return mass, friction and offset of a drive in SI."""
    values = nls.flatten(drive).values
    return {name: values[parameter] for name, (parameter, _) in FITTED.items()}


def write_page(results: Results, out: Path) -> None:
    """Write the verdict, the errors on the half that no fit has used, and the numbers."""
    viscous, better = results.viscous.named(""), results.better.named("")
    rows = tuple(
        (name.strip("_").replace("_", " "), f"{viscous[name]:.3g}", f"{better[name]:.3g}") for name in viscous
    )
    numbers = [
        PublishedNumber(name, results.published[name], results.fitted[name], unit)
        for name, (_, unit) in FITTED.items()
    ]
    nls.write_report(
        out / "report.html",
        *verdict_sections(results.verdict),
        TableSection(
            "Second half",
            ("error", "viscous friction alone", "with the named effects"),
            rows,
            caption="Errors on the half that no fit has seen.",
        ),
        comparison_table(
            "Fitted on the first half, and published",
            numbers,
            caption="The same numbers as their authors give them.",
        ),
        title="EMPS: what is missing",
    )
