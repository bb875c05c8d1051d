"""Templates: ordinary decks with comments, whose numbers and rubber are replaced line by line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...foundation.deck import Deck, commands_named_in, read_deck, template_text
from ...foundation.errors import DeckError, NlsError, unknown_name
from ...foundation.quantity import Quantity
from ..mechanics.bodies import GearedMotor
from ..mechanics.gear import Gear
from ..mechanics.motor import ElectricMotor
from ..sensing.sensors import Encoder
from .deck_writer import declare
from .named_parts import Assembly
from .part_text import number_of, text_of

GIVEN = "assumed: given when the deck was made; say here where it is from"
"""Source of a number that was given without one."""
ROTOR, OUTPUT = PLACES = ("rotor", "output")
"""Where the inertia of a motor may be given: in front of the gear, or behind it."""
_ASKED = "# Asked: "


@dataclass(frozen=True)
class AskedNumber:
    """A number that a template asks for."""

    name: str
    meaning: str
    usual: Quantity


@dataclass(frozen=True)
class DeckTemplate:
    """A deck to begin with."""

    name: str  # for instance "cam-actuator"
    # text: TOML; a comment # Asked: ... stands above each number that is asked for, and # Ready for: ...
    # names the commands that the template is meant for.
    text: str

    @property
    def deck(self) -> Deck:
        """The template as a deck."""
        return read_deck(self.text, Path(f"{self.name}.toml"))

    @property
    def ready_for(self) -> tuple[str, ...]:
        """The commands that the template is meant for."""
        return commands_named_in(self.text)

    def questions(self) -> list[AskedNumber]:
        """Return the numbers that are asked for, in written order."""
        deck, lines = self.deck, self.text.splitlines()
        return [
            AskedNumber(name, lines[number - 2].removeprefix(_ASKED), deck.quantity(name))
            for name in deck.numbers()
            if (number := deck.places[name][0]) > 1 and lines[number - 2].startswith(_ASKED)
        ]

    def materials(self) -> dict[str, str]:
        """Return the rubber of the library that each piece is made of, by the name of its field."""
        return dict(_materials("", self.deck.tables))

    def carried(self, at: MotorInertia, numbers: Mapping[str, Quantity]) -> dict[str, Quantity]:
        """Return what another gear ratio than that of the template changes at the output.

        That is the inertia of the motor, and one count of an encoder on its rotor.

        Result: numbers by name, without those that are given; empty where the ratio is that of the template,
        or where the motor stands in front of the gear, so that no gear changes what is seen there.
        """
        if at.place == ROTOR or at.ratio not in numbers or numbers[at.ratio].number <= 0.0:
            return {}
        ratio, new = self.deck.quantity(at.ratio), numbers[at.ratio]
        share = new.number / ratio.number
        factors = {at.name: (share**2, f"times ({new}/{ratio})^2")}
        factors |= {name: (1.0 / share, f"times {ratio}/{new}") for name in at.counts}
        carried = {}
        for name, (factor, how) in factors.items():
            if name not in numbers:
                usual = self.deck.quantity(name)
                source = f"{usual.source}; {how}, for another gear ratio"
                value = float(f"{usual.number * factor:.6g}")
                carried[name] = Quantity(value, usual.unit, source, usual.spread)
        return carried

    def filled(
        self,
        name: str,
        *,
        numbers: Mapping[str, Quantity] | None = None,
        material: str | None = None,
    ) -> str:
        """Return the text of a deck of one's own; it was read once and declares a machine.

        ``numbers``: in place of those of the template, by full name; one without a spread keeps that of the
        template.
        """
        deck, lines = self.deck, self.text.splitlines()
        for full, given in (numbers or {}).items():
            if full not in deck.numbers():
                raise unknown_name(f"template {self.name}: number", full, deck.numbers())
            kept = given if given.spread else replace(given, spread=deck.quantity(full).spread)
            lines[deck.places[full][0] - 1] = f"{full.rpartition('.')[2]} = {number_of(kept)}"
        lines[deck.places["deck.name"][0] - 1] = f"name = {text_of(name)}"
        if material is not None:
            if not self.materials():
                rule = "has no piece of rubber, so no material belongs to it"
                raise DeckError(f"template {self.name}", rule, next_step="leave --material out")
            for field in self.materials():
                lines[deck.places[field][0] - 1] = f"material = {text_of(material)}"
        lines = [f"# {line.removeprefix(_ASKED)}." if line.startswith(_ASKED) else line for line in lines]
        text = "\n".join(lines) + "\n"
        try:
            declare(read_deck(text, Path(f"{name}.toml")))
        except NlsError as error:
            # An error without the line of a file that is not there yet.
            thing = re.sub(rf"^{re.escape(name)}\.toml(:\d+)*: ", "", error.thing)
            words = {"did_you_mean": error.did_you_mean, "next_step": error.next_step}
            raise type(error)(f"template {self.name}: {thing}", error.rule, **words) from None
        return text


def load_template(name: str) -> DeckTemplate:
    """Return a template."""
    return DeckTemplate(name, template_text(name))


@dataclass(frozen=True)
class MotorInertia:
    """Where a machine holds the inertia of its motor, and which gear lies between rotor and output."""

    name: str  # full name of the inertia
    place: str  # "rotor" or "output": where the component takes it
    ratio: str  # full name of the ratio of the gear
    counts: tuple[str, ...] = ()  # full names of the counts of encoders that read the angle at the output

    def converted(self, given: Quantity, *, at: str, ratio: Quantity) -> Quantity:
        """Return an inertia as the component takes it; the source says how it was converted."""
        if at == self.place:
            return replace(given, source=f"{given.source}, at the {at}")
        squared = ratio.number**2
        if at == ROTOR:
            factor, how = squared, f"times the gear ratio squared, {ratio}^2"
        else:
            factor, how = 1.0 / squared, f"divided by the gear ratio squared, {ratio}^2"
        return Quantity(
            float(f"{given.number * factor:.12g}"),
            given.unit,
            f"{given.source}; {given} at the {at}, {how}",
            given.spread.times(factor),
        )


def motor_inertia(machine: Assembly) -> MotorInertia | None:
    """Return where a machine holds the inertia of its motor; ``None`` where there is no gear."""
    for name, part in machine.parts:
        if isinstance(part, GearedMotor):
            angle = f"{name}.angle"
            counts = tuple(
                f"{each}.quantum"
                for each, sensor in machine.parts
                if isinstance(sensor, Encoder) and sensor.of == angle
            )
            return MotorInertia(f"{name}.inertia", OUTPUT, f"{name}.gear_ratio", counts)
    for name, part in machine.parts:
        if isinstance(part, Gear) and isinstance(machine[part.between[0]], ElectricMotor):
            return MotorInertia(f"{part.between[0]}.inertia", ROTOR, f"{name}.ratio")
    return None


def plain_name(text: str) -> str:
    """Return a name for a deck from the name of its file."""
    return re.sub(r"\W+", "_", text).strip("_") or "deck"


def _materials(path: str, table: Mapping[str, Any]) -> list[tuple[str, str]]:
    fields: list[tuple[str, str]] = []
    for key, raw in table.items():
        full = f"{path}.{key}" if path else key
        if key == "material" and isinstance(raw, str):
            fields.append((full, raw))
        elif isinstance(raw, Mapping):
            fields += _materials(full, raw)
    return fields
