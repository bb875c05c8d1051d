"""Write records of a simulated bench, on which wires pull at the joint of the deck; nothing is measured."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import rubber_lab
from rubber_lab.laws import WireBundle

import nlsdesign as nls
from nlsdesign.foundation.extensions import extended_by


def main(folder: Path) -> None:
    """Write four records of four seconds."""
    with extended_by(rubber_lab):
        declared = nls.declare(nls.load_deck(str(Path(__file__).parent / "decks" / "jointed.toml")))
    law = WireBundle(stiffness=nls.quantity(0.15, "N*m/rad"), hardening_angle=nls.quantity(0.5, "rad"))
    built = declared.with_part("wires", nls.tie(law, "motor"))
    model = nls.flatten(built, outputs=["motor.angle"])
    time = np.arange(0.0, 4.0, 2e-3)
    folder.mkdir(parents=True, exist_ok=True)
    for number, (hertz, amps) in enumerate([(0.5, 3.0), (1.0, 4.0), (2.0, 3.0), (0.8, 2.0)], start=1):
        phase = 2 * np.pi * hertz * time
        current = amps * (np.sin(phase) + 0.3 * np.sin(2.7 * phase)) * np.minimum(1.0, time)
        run = nls.simulate(model, time, inputs={"motor.current": current})
        reading = nls.measure(run, built, seed=number)["motor_encoder.reading"]
        rows = np.column_stack([time, current, reading])
        heads = "t_s,current_A,angle_rad"
        np.savetxt(folder / f"run{number}.csv", rows, "%.6f", ",", header=heads, comments="")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "records"))
