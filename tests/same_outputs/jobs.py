"""What is recorded: commands in groups, the cheap groups first."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("NLSDESIGN_SHARED", "/nowhere"))
MAIN, SOFT, FINGER = "austin2015_figure_consistent", "austin2015_soft_spring", "one_sided_cable_drive"
NEW_FINGER = "deck new --template one-sided-finger new.toml"  # an observer serves it, FINGER has none
# Which of the models in Python declares which deck.
MODELS = {
    "cam_rubber_actuator": MAIN,
    "linear_spring_actuator": SOFT,
    "one_sided_cable_drive": FINGER,
    "positioning_drive": "janot2019_positioning_drive",
    "elastomer_specimen": "vhb4910_specimen",
}


@dataclass(frozen=True)
class Job:
    """Commands that run one after the other in a folder of their own, with the files that they read.

    A command is what stands behind ``nlsdesign``; ``flat``, ``views`` and ``table`` are those of ``dumps``.
    """

    name: str
    commands: tuple[str, ...]
    quick: bool = False
    files: dict[str, str] = field(default_factory=dict)


def jobs() -> Iterator[Job]:
    """All jobs, the cheap groups first."""
    yield from _decks()
    yield from _code()
    yield from _analysis()
    yield from _design()
    yield from _diagnose()
    yield from _sweep()
    for study in sorted(_studies()):
        yield Job(
            f"studies/{study}", (f"study run {study} --fast --workers 1 --json --out out",), study == "hello"
        )


def _decks() -> Iterator[Job]:
    for deck in _deck_names():
        commands = (f"flat {deck}", f"deck show {deck} --json", f"deck check {deck} --json")
        yield Job(f"decks/{deck}", commands, deck in (MAIN, FINGER))
    yield Job(
        "decks/texts", tuple(f"deck {what} {deck}" for what in ("show", "check") for deck in (MAIN, FINGER))
    )
    for model, deck in MODELS.items():
        yield Job(f"decks/model_{model}", (f"flat {deck} {model}",), model == "cam_rubber_actuator")
    for template in sorted(file.stem for file in (CHECKOUT / "models/templates").glob("*.toml")):
        yield Job(f"decks/new_{template}", (f"deck new --template {template} new.toml", "flat new.toml"))
    lists = ("parts", "materials", "deck list", "study list")
    yield Job("decks/lists", tuple(f"{words} --json" for words in lists))
    commands = {
        "": (
            "",
            "simulate",
            "cosimulate",
            "diagnose",
            "fit",
            "compare",
            "sweep",
            "report",
            "serve",
            "completion",
        ),
        "deck ": ("", "show", "check", "copy", "new", "from-rig", "list"),
        "observer ": ("", "calibrate", "certify-continuous", "verify"),
        "export ": ("", "c", "controller", "fmu", "modelica", "ssp", "check"),
        "analyse ": ("", "angle", "loop"),
        "study ": ("", "list", "run"),
    }
    yield Job("decks/help", tuple(f"{a}{b} --help" for a in commands for b in commands[a]))


def _code() -> Iterator[Job]:
    def c(deck: str, words: str) -> str:
        return f"export c --deck {deck} {words} --json --out c"

    yield Job("code/default", (c(MAIN, ""), "export check c --json"), True)
    yield Job("code/cascade", (c(MAIN, "--kind cascade"), "export check c"), True)
    yield Job(
        "code/loop_float", (c(MAIN, "--what both --kind cascade --real float --flash 64kB --examples"),)
    )
    yield Job("code/loop_default", (c(MAIN, "--what both"),))
    yield Job("code/controller_pid", (c(MAIN, "--what controller --law pid"),))
    yield Job("code/controller", (f"export controller --deck {MAIN} --bandwidth '8 Hz' --fmu --out c",))
    for kind in ("certified", "kalman", "published"):
        yield Job(f"code/{kind}", (c(MAIN, f"--kind {kind}"),))
    yield Job("code/soft_default", (c(SOFT, "--what both"),))
    yield Job("code/one_sided_default", (NEW_FINGER, c("new.toml", "--what both")))
    yield Job("code/one_sided_cascade", (NEW_FINGER, c("new.toml", "--kind cascade --real float")))
    yield Job("code/observer_errors", (f"observer --deck {MAIN} --errors --draws 4 --json --out c",))
    wires = (
        "--wire brain.motor.angle=plant.motor_encoder.reading --order brain --order plant "
        "--wire plant.motor.current=brain.motor.current@1sample"
    )
    fmus = "--fmu plant=fmu/plant.fmu --fmu brain=fmu/observer_and_controller.fmu"
    run = "--input brain.spring.torque.desired=0.4@1 --stop '0.2 s'"
    yield Job(
        "code/fmu3",
        (
            f"export fmu --deck {MAIN} --kind cascade --reference --out fmu",
            f"export ssp {fmus} {wires} --out system.ssp",
            f"cosimulate {fmus} {wires} {run} --json --out run.csv",
        ),
    )
    yield Job("code/fmu2", (f"export fmu --deck {MAIN} --kind cascade --version 2.0 --out fmu",), True)
    yield Job("code/fmu_default", (f"export fmu --deck {MAIN} --what observer --out fmu",))
    yield Job("code/finger_fmu", (f"export fmu --deck {FINGER} --what plant --reference --out fmu",))
    for deck in _deck_names():
        yield Job(f"code/modelica_{deck}", (f"export modelica --deck {deck} --out plant.mo",), deck == MAIN)


def _analysis() -> Iterator[Job]:
    for deck in (MAIN, SOFT, FINGER):
        over = f"analyse --deck {deck} --count 6 --json --out out"
        yield Job(f"analysis/angle_{deck}", (over, f"views {deck}"), deck == MAIN)
    for law in ("pid", "scheduled"):
        loop = f"analyse loop --deck {MAIN} --law {law} --amplitude '0.5 N*m' --json --out out"
        yield Job(f"analysis/loop_{law}", (loop,), law == "scheduled")
    loop = "analyse loop --deck new.toml --law scheduled --json --out out"
    yield Job("analysis/loop_one_sided", (NEW_FINGER, loop))
    proofs = {
        "certified": "--kind certified --certificate",
        "with_spread": "--kind certified --certificate --with-spread",
        "continuous": "certify-continuous",
    }
    for name, asked in proofs.items():
        deck = f"--deck {MAIN}"
        words = f"{deck} {asked}" if asked.startswith("-") else f"{asked} {deck}"
        yield Job(f"analysis/proof_{name}", (f"observer {words} --json --out out",), name == "certified")
    yield Job("analysis/calibration_plan", (f"observer calibrate --deck {MAIN} --plan --json --out out",))
    for deck in (MAIN, SOFT, FINGER):
        sine = f"simulate --deck {deck} --input 'motor.current=2 A sine 3 Hz' --stop '0.5 s'"
        sharp = f"{sine} --friction sharp --json --table-only --out sharp.csv"
        yield Job(f"analysis/simulate_{deck}", (f"{sine} --json --out run.csv", sharp), deck == MAIN)


def _design() -> Iterator[Job]:
    job = (
        'free = ["spring.cam.contour", "spring.pretension", '
        '"spring.rubber.area", "spring.rubber.rest_length"]\n'
        '[target]\nExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0}\n'
        '[limits]\nMaximumCamRadius = {radius = "20 mm"}\n[search]\nstarts = 2\nlargest_error = "1 %"\n'
        '[drawing]\ngroove_depth = "2 mm"\nhub_bore = "3 mm"\n'
    )
    command = f"design --deck {MAIN} --task job.toml --draws 50 --workers 1 --json --out out"
    yield Job(
        "design/target_2014",
        (command, f"compare out {CHECKOUT}/models/decks/{MAIN}.toml --json --out compared"),
        True,
        {"job.toml": job},
    )
    missed = (
        f"design --deck {MAIN} --maximum '5 N*m' --angle '53 deg' --starts 2 --draws 0 --workers 1 --out out "
        "--free spring.cam.contour --free spring.pretension --limit 'MaximumCamRadius = {radius = \"20 mm\"}'"
    )
    yield Job("design/missed", (missed,))
    curve = "angle [deg],torque [N*m]\n" + "".join(
        f"{angle},{angle / 45 * (0.5 + angle / 90):.4f}\n" for angle in range(0, 50, 5)
    )
    finger = (
        f"design --deck {FINGER} --target-file curve.csv --free spring.cam.contour "
        "--free spring.cable.rope.rubber.area --largest-error '3 %' --goal 'TorqueError = {}' "
        "--starts 2 --draws 50 --workers 1 --json --out out"
    )
    yield Job("design/one_sided", (finger,), False, {"curve.csv": curve})
    stock = (
        f"design --deck {MAIN} --maximum '5 N*m' --angle '53 deg' --starts 1 --draws 0 --workers 1 --json "
        "--out out --free spring.cam.contour --free spring.pretension --free spring.rubber.area "
        '--stock \'"spring.rubber.rest_length" = ["60 mm", "80 mm"]\''
    )
    yield Job("design/stock", (stock,))
    yield Job("design/kinds", tuple(f"design --list {kind}" for kind in ("targets", "limits", "goals")))


def _diagnose() -> Iterator[Job]:
    # A machine with dry friction, and a deck of it that has forgotten the friction.
    text = (CHECKOUT / f"models/decks/{SOFT}.toml").read_text(encoding="utf8")
    forgotten = re.sub(r"\[dry_friction\]\n(?:[^\[\n].*\n|\n)*", "", text)
    bench = [
        f"simulate --deck {SOFT} --value 'dry_friction.sliding_effort=0.08 N*m' --stop '2 s' --step '2 ms' "
        f"--input 'motor.current=2 A sine {hertz} Hz' --readings {hertz} --table-only "
        f"--out set/run{hertz}.csv"
        for hertz in (1, 2, 3)
    ]
    asked = "--deck forgotten.toml --records set --json"
    found = (
        f"diagnose {asked} --workers 1 --regenerate --out out",
        f"fit {asked} --window '1 s' --out fit",
        "compare out forgotten.toml --json --out compared",
    )
    yield Job("diagnose/forgotten_friction", (*bench, *found), True, {"forgotten.toml": forgotten})
    for folder in sorted(file for file in (SHARED / "practice").glob("*") if file.is_dir()):
        more = "--regenerate" if folder.name == "p01" else ""
        deck = f"deck from-rig {SHARED}/practice/rig.toml {SHARED}/practice/cam.csv --out rig.toml"
        asked = f"diagnose --deck rig.toml --records {folder} --workers 1 --json --out out {more}"
        yield Job(f"diagnose/{folder.name}", (deck, asked))


def _sweep() -> Iterator[Job]:
    points = (
        f'decks = "{MAIN}"\n[[axes]]\n'
        'GridAxis = {name = "spring.rubber.rest_length", lower = "40 mm", upper = "60 mm", count = 2}\n'
        "[[axes]]\n"
        'SobolSample = {ranges = {"ask.target.maximum" = ["2 N*m", "4 N*m"]}, count = 2, seed = 1}\n'
        '[ask.DesignQuestion]\nfree = ["spring.cam.contour", "spring.pretension"]\n'
        'target.ExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0}\n'
        'limits.MaximumCamRadius = {radius = "30 mm"}\n'
    )
    commands = ("sweep sweep.toml --out out --workers 1 --report page", "table out")
    yield Job("sweep/designs", commands, True, {"sweep.toml": points})


def _deck_names() -> list[str]:
    return sorted(file.stem for file in (CHECKOUT / "models/decks").glob("*.toml"))


def _studies() -> set[str]:
    places = (CHECKOUT / "studies").iterdir()
    return {place.stem for place in places if place.suffix == ".py" or (place / "__init__.py").exists()} - {
        place.stem for place in (CHECKOUT / "studies").glob("_*.py")
    }
