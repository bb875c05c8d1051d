"""Rubber models side by side: the six of the paper and more, on its Fig. 6 and on bench records.

Every model is fitted by simulation to the same records and judged on others. Fig. 6: fitted to the stretch at
45°, judged on that at 25°; its force lags, which no passive law can follow (see the audit). The bench records
come from a rig simulation that shares no code with the package.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import nlsdesign as nls
from nlsdesign.bench.identification import Agreement, Shots, agreement, noise_of
from nlsdesign.components import (
    TRANSLATION,
    Driven,
    Element,
    LinearElastic,
    Rounded,
    StrainStiffening,
    Yeoh,
    burgers,
    generalised_maxwell,
    kelvin_voigt,
    maxwell,
)
from nlsdesign.foundation.arrays import Array
from nlsdesign.presentation.report import FigureSection, TableSection

from ._published import FIG6_SAMPLE, bench_records, declared_actuator, element_loop, with_bench_sensors

EXTENSION, FORCE = "grip.position", "rubber.force"
FITTED = ("modulus", "viscosity", "c1", "c2", "c3")
SHOWN = ("Hooke", "standard linear solid", "stiffening, three times")
ANGLES = np.linspace(-1.0, 1.0, 801)  # rad; where the extension is computed
THINNING = 4  # one bench sample of so many is kept: 125 a second for 5 Hz


# --- results --------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Judgement:
    """Agreement over some records, and force in N over extension in m as simulated for the last of them."""

    agreement: Agreement
    extension: Array
    force: Array


@dataclass(frozen=True, eq=False)
class Comparison:
    """One fitted model on one set of records: on those that it was fitted to, and on the others."""

    records: str
    law: str
    train: Judgement
    test: Judgement

    @property
    def name(self) -> str:
        """Name of the claimed number."""
        words = re.sub(r"[ -]", "_", re.sub(r"[(),]", "", self.law))
        return f"{self.records}_{words}_test_percent"

    @property
    def row(self) -> tuple[str, ...]:
        """Row of the table."""
        values = (*self.train.agreement, *self.test.agreement)
        return self.records, self.law, *(f"{value:.3g}" for value in values)


@dataclass(frozen=True, eq=False)
class Results:
    """All models on all sets."""

    comparisons: tuple[Comparison, ...]

    @property
    def numbers(self) -> dict[str, float]:
        """Mean relative error in per cent on the records that no fit has used."""
        return {each.name: each.test.agreement.relative for each in self.comparisons}


def main(out: Path, fast: bool = False) -> Results:
    """Fit every law to both sets, print the table and draw it."""
    steps, actuator = nls.progress.Steps(), declared_actuator()
    sets = (fig6_stretches(), bench_stretches(actuator))
    comparisons = []
    for name, law in laws().items():
        with steps.step(f"fitting {name}"):
            model = nls.flatten(element(actuator, law))
            comparisons += [compare(name, model, records) for records in sets]
    results = Results(tuple(comparisons))
    write_page(results, out)
    for row in (each.row for each in results.comparisons):
        print("  ".join(f"{cell:>27s}" if i == 1 else f"{cell:>9s}" for i, cell in enumerate(row)))
    return results


# --- laws and records -----------------------------------------------------------------------------


def laws() -> dict[str, Element]:
    """Return the laws by name with a start for their numbers; the paper compares or prints the first six."""
    q, one_time = nls.quantity, {"modulus": 1e6, "viscosity": 2e4}
    moduli, knots = q((2.0, 1.5, 2.0, 2.0), "MPa"), q((0.0, 0.016, 0.0848, 0.212), "1")
    stiffening = StrainStiffening(modulus=moduli, knots=knots)
    rounded = StrainStiffening(modulus=moduli, knots=knots, contact=Rounded(width=q(0.01, "1")))
    yeoh = Yeoh(c1=q(0.5, "MPa"), c2=q(0.1, "MPa"), c3=q(0.01, "MPa"))
    return {
        "Hooke": LinearElastic(modulus=q(3.0, "MPa")),
        "Kelvin-Voigt": kelvin_voigt(modulus=3e6, viscosity=3e3),
        "Maxwell": maxwell(modulus=4e6, viscosity=1e6),
        "standard linear solid": nls.standard_linear_solid(3e6, **one_time),
        "Burgers": burgers(modulus=4e6, flow=1e7, delayed_modulus=1e7, delayed_viscosity=1e5),
        "stiffening solid (printed)": nls.standard_linear_solid(stiffening, **one_time),
        "stiffening solid, rounded": nls.standard_linear_solid(rounded, **one_time),
        "stiffening, three times": generalised_maxwell(
            stiffening, moduli=(5e5, 5e5, 5e5), times=(0.01, 0.1, 1.0)
        ),
        "Yeoh with one time": nls.standard_linear_solid(yeoh, **one_time),
    }


def element(actuator: nls.Assembly, law: Element) -> nls.Assembly:
    """Return one rubber element of the actuator with another law, pulled by a grip."""
    size = {name: actuator.quantities()[f"spring.rubber.{name}"] for name in ("area", "rest_length")}
    piece = nls.specimen(area=size["area"], rest_length=size["rest_length"], law=law)
    return nls.assembly("element", grip=Driven(domain=TRANSLATION), rubber=nls.tie(piece, "grip"))


@dataclass(frozen=True, eq=False)
class Stretches:
    """Records of one element, to fit and to judge on, with the integration steps per sample."""

    name: str
    train: Sequence[nls.Record]
    test: Sequence[nls.Record]
    substeps: int


def stretch_record(name: str, time: Array, extension: Array, force: Array) -> nls.Record:
    """Return a record of extension in m and force in N over time in s."""
    return nls.Record(
        name, nls.Trace(time, {EXTENSION: extension, FORCE: force}, {EXTENSION: "m", FORCE: "N"}, name)
    )


def fig6_stretches() -> Stretches:
    """Return the stretches of Fig. 6: that at 45° to fit, that at 25° to judge on."""
    records = []
    for degrees in (45, 25):
        extension, force = element_loop(degrees)
        time = FIG6_SAMPLE * np.arange(len(force), dtype=np.float64)
        records.append(stretch_record(f"{degrees}°", time, extension, force))
    return Stretches("fig6", records[:1], records[1:], 2)


def bench_stretches(actuator: nls.Assembly) -> Stretches:
    """Return the bench records as extension and force; the held-out ones to judge on."""
    rig = with_bench_sensors(actuator)
    model = nls.flatten(rig)
    extension = np.array([extension_at(model, angle) for angle in ANGLES])
    records = bench_records(rig)

    def stretch(record: nls.Record) -> nls.Record:
        trace, rows = record.trace, slice(None, None, THINNING)
        path = np.interp(trace["motor_encoder.reading"], ANGLES, extension)
        return stretch_record(record.name, trace.time[rows], path[rows], trace["load_cell.reading"][rows])

    train, test = ([stretch(record) for record in records.of(role)] for role in ("fit", "held_out"))
    return Stretches("bench", train, test, 4)


def extension_at(model: nls.FlatModel, angle: float) -> float:
    """Return the extension of the cable in m at an angle of the motor in rad."""
    state = model.start(model.states)
    state[[v.name for v in model.states].index("motor.angle")] = angle
    return float(model.evaluate(list(state))["spring.cable.extension"])


# --- fit and judgement ----------------------------------------------------------------------------


def compare(law: str, model: nls.FlatModel, records: Stretches) -> Comparison:
    """Fit a model to the training records and judge it on both kinds."""
    fitted = fit(model, records)
    train, test = (judge(fitted, each, records.substeps) for each in (records.train, records.test))
    return Comparison(records.name, law, train, test)


def fit(model: nls.FlatModel, records: Stretches) -> nls.FlatModel:
    """Return the model fitted to the training records; nothing is known of its numbers but a start."""
    free = [
        nls.free_parameter(v, reach=100.0)
        for v in model.parameters
        if v.name.rpartition(".")[2].partition("[")[0] in FITTED
    ]
    # The whole record from rest: a window longer than any record, that begins where the model does.
    shots = Shots(1e3, joined=False, substeps=records.substeps)
    return model.with_values(nls.fit_by_simulation(model, records.train, free, shots=shots).fit.values)


def judge(model: nls.FlatModel, records: Sequence[nls.Record], substeps: int) -> Judgement:
    """Simulate whole records and compare with the measured force."""
    measured, simulated = [], []
    for record in records:
        length = record.trace.time[-1] - record.trace.time[0]
        prediction = nls.predict_in_windows(model, record, length, substeps=substeps)
        measured.append(record.trace[FORCE][: len(prediction.time)])
        simulated.append(measured[-1] + prediction.error[FORCE])
    noise = float(np.median([noise_of(force) for force in measured]))
    result = agreement(np.concatenate(measured), np.concatenate(simulated), noise=noise)
    return Judgement(result, records[-1].trace[EXTENSION][: len(simulated[-1])], simulated[-1])


def write_page(results: Results, out: Path) -> None:
    """Write the table of all models, and the last held-out bench record as three of them simulate it."""
    measures = ("% relative", "rms in N", "% of deviation", "times noise")
    columns = ("set", "model", *(f"{role}: {m}" for role in ("train", "test") for m in measures))
    tests: Mapping[str, Judgement] = {c.law: c.test for c in results.comparisons if c.records == "bench"}
    figure = nls.figures.curves(
        {law: (1e3 * tests[law].extension, tests[law].force) for law in SHOWN},
        across="extension in mm",
        up="force in N",
        words="Force of three models over the extension of a held-out record.",
    )
    nls.write_report(
        out / "report.html",
        TableSection(
            "All models",
            columns,
            tuple(each.row for each in results.comparisons),
            caption="Each model on each data set, with its errors.",
        ),
        FigureSection("A held-out bench record", figure, caption="Simulated; no fit has used the record."),
        title="Rubber models compared",
    )
