"""Rubber models side by side: the six of the paper and more, on its Fig. 6 and on bench records.

Every model is fitted by simulation to the same records and judged on others. Fig. 6: fitted to the stretch at
45°, judged on that at 25°; its force lags, which no passive law can follow (see the audit). The bench records
come from a rig simulation that shares no code with the package.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import nlsdesign as nls

from ._rubber_models import FORCE, bench, element, laws, published

DECK = "austin2015_figure_consistent"
FITTED = ("modulus", "viscosity", "c1", "c2", "c3")
SHOWN = ("Hooke", "standard linear solid", "stiffening, three times")


def main(out: Path, fast: bool = False, steps: Any = None) -> dict[str, float]:
    """Fit every law to both sets, print the table and draw it.

    Parameters
    ----------
    out
        Folder for ``report.html``.
    fast, steps
        No shorter way is needed; shows progress.
    """
    steps = steps or nls.progress.Steps()
    actuator = nls.models.cam_rubber_actuator(nls.load_deck(DECK))
    sets = {"fig6": published(), "bench": bench(actuator)}
    rows, found, curves = [], {}, {}
    for name, law in laws().items():
        with steps.step(f"fitting {name}"):
            for label, (train, test, substeps) in sets.items():
                model = nls.flatten(element(actuator, law))
                fitted = fit(model, train, substeps)
                both = [judged(fitted, records, substeps) for records in (train, test)]
                rows.append((label, name, *(f"{v:.3g}" for each in both for v in each[0])))
                key = name.replace(" ", "_").replace("-", "_").replace(",", "").strip("()")
                found[f"{label}_{key.replace('(', '').replace(')', '')}_test_percent"] = both[1][0].relative
                if label == "bench":
                    curves[name] = both[1][1]
    measures = ("% relative", "rms in N", "% of deviation", "times noise")
    columns = ("set", "model", *(f"{role}: {m}" for role in ("train", "test") for m in measures))
    nls.write_report(out / "report.html", *pages(columns, rows, curves), title="Rubber models compared")
    print("\n".join("  ".join(f"{c:>27s}" if i == 1 else f"{c:>9s}" for i, c in enumerate(r)) for r in rows))
    return found


def fit(model: Any, records: list[Any], substeps: int) -> Any:
    """Return the model fitted to records; nothing is known of its numbers but a start."""
    free = [
        nls.free_parameter(v, reach=100.0)
        for v in model.parameters
        if v.name.rpartition(".")[2].partition("[")[0] in FITTED
    ]
    # The whole record from rest: a window longer than any record, that begins where the model does.
    shots = nls.identification.Shots(1e3, joined=False, substeps=substeps)
    return model.with_values(nls.fit_by_simulation(model, records, free, shots=shots).fit.values)


def judged(model: Any, records: list[Any], substeps: int) -> tuple[Any, Any]:
    """Return the agreement over records, and measured against simulated force of the last of them."""
    found = [
        nls.predict_in_windows(model, r, r.trace.time[-1] - r.trace.time[0], substeps=substeps)
        for r in records
    ]
    measured = [r.trace[FORCE][: len(p.time)] for r, p in zip(records, found, strict=True)]
    predicted = [m + p.error[FORCE] for m, p in zip(measured, found, strict=True)]
    noise = float(np.median([nls.identification.noise_of(m) for m in measured]))
    result = nls.agreement(np.concatenate(measured), np.concatenate(predicted), noise=noise)
    return result, (records[-1].trace["grip.position"][: len(predicted[-1])], predicted[-1])


def pages(columns: tuple[str, ...], rows: list[Any], curves: dict[str, Any]) -> list[Any]:
    """Return the report."""
    shown = {name: (1e3 * curves[name][0], curves[name][1]) for name in SHOWN}
    words = "Force of three models over the extension of a held-out record."
    figure = nls.figures.curves(shown, across="extension in mm", up="force in N", words=words)
    return [
        nls.report.TableSection("All models", columns, tuple(rows)),
        nls.report.FigureSection(
            "A held-out bench record", figure, caption="Simulated, none has seen the record."
        ),
    ]
