"""``nlsdesign deck new``: a deck from a template, asked on the terminal or given by options."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..foundation.errors import ExportError, NlsError, UnitError, nearest, unknown_name
from ..foundation.quantity import Quantity, same_dimension, typeset_unit
from ..foundation.text_files import write_text
from .options import json_option
from .output import examples, next_command, show_json
from .typed_values import parse_number, split_number

if TYPE_CHECKING:
    from ..components import AskedNumber, DeckTemplate, MotorInertia

ROTOR, OUTPUT = "rotor", "output"
force_option = click.option("--force", is_flag=True, help="Replace the file where there is one.")


@click.command(
    "new",
    epilog=examples(
        "nlsdesign deck new finger.toml --template one-sided-finger",
        "nlsdesign deck new leg --template cam-actuator --material Dragon_Skin_30 --yes",
        'nlsdesign deck new leg --template cam-actuator --inertia "140 g*cm^2" --inertia-at rotor '
        "--set motor.gear_ratio=14",
    ),
)
@click.argument("path", metavar="NAME_OR_FILE")
@click.option(
    "--template", default=None, metavar="TEMPLATE", help="What to begin with; asked for on a terminal."
)
@click.option("--material", default=None, metavar="NAME", help="Rubber, as `nlsdesign materials` lists it.")
@click.option("--set", "given", multiple=True, metavar="NAME=VALUE",
              help="A number of the template, e.g. 'motor.gear_ratio=14'; repeatable.")  # fmt: skip
@click.option("--inertia", default=None, metavar="VALUE", help="Inertia of the motor, with its place.")
@click.option("--inertia-at", "place", type=click.Choice([ROTOR, OUTPUT]), default=None,
              help="Whether --inertia is that of the rotor or that at the gear's output.")  # fmt: skip
@click.option("--yes", is_flag=True, help="Ask nothing: take the numbers of the template.")
@force_option
@json_option
def new(
    path: str, template: str | None, material: str | None, given: tuple[str, ...], yes: bool, force: bool,
    **others: Any,
) -> None:  # fmt: skip
    """Write a deck from a template. It is commented and names the commands that it is ready for.

    On a terminal the numbers that matter are asked for, with unit and usual value; elsewhere, and with --yes,
    those of the template are taken unless --set gives another. A name without .toml gets it.
    """
    from ..components import deck_remarks, declare, load_template, motor_inertia, plain_name
    from ..foundation.deck import read_deck, template_names

    if path.endswith(("/", os.sep)) or not Path(path).name.strip("."):
        raise click.BadParameter(f"'{path}' is no name of a file, for instance leg.toml")
    file = Path(path) if path.endswith(".toml") else Path(f"{path}.toml")
    refuse_to_replace(file, force)
    asking = not (yes or others["as_json"]) and on_terminal()
    if template is None:
        if not asking:
            raise click.UsageError(f"--template is missing; templates are: {', '.join(template_names())}")
        template = click.prompt("Template", type=click.Choice(template_names()), default="cam-actuator")
    chosen = load_template(template)
    numbers = _given(chosen, given)
    at = motor_inertia(declare(chosen.deck))
    numbers |= _inertia(chosen, at, numbers, others["inertia"], others["place"])
    if asking:
        material = material or _asked_material(chosen)
        numbers |= _asked(chosen, at, numbers)
    name = plain_name(file.stem)
    text = chosen.filled(name, numbers=numbers, material=material)
    remarks = deck_remarks(declare(read_deck(text, file)))
    write_text(file, text)
    if others["as_json"]:
        ready, count = list(chosen.ready_for), len(chosen.deck.numbers())
        show_json({"file": file, "numbers": count, "ready_for": ready, "warnings": remarks})
        return
    for remark in remarks:
        click.echo(f"warning: {remark}")
    commands = ", ".join(map(shown_command, chosen.ready_for))
    click.echo(f"written: {file}, {len(chosen.deck.numbers())} numbers; ready for {commands}")
    click.echo(f"next: {next_command('deck', 'check', file)}")


def on_terminal() -> bool:
    """Tell whether questions can be asked and answered."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def refuse_to_replace(file: Path, force: bool) -> None:
    """Refuse to write over a file that is there, unless that is asked for."""
    try:
        there = file.exists()
    except OSError as error:
        step = "give a shorter name"
        raise ExportError(
            f"{str(file)[:60]}...", f"cannot be written: {error.strerror}", next_step=step
        ) from None
    if there and not force:
        raise ExportError(
            str(file), "is there already", next_step="give another name, or --force to replace it"
        )


def _given(template: DeckTemplate, given: tuple[str, ...]) -> dict[str, Quantity]:
    from ..components import GIVEN

    numbers: dict[str, Quantity] = {}
    for text in given:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise click.BadParameter(f"'{text}' is not NAME=VALUE, for instance motor.gear_ratio=14")
        known = template.deck.numbers()
        if name not in known:
            raise unknown_name(f"template {template.name}: number", name, known)
        if name in numbers:
            raise click.BadParameter(f"'{name}' is set twice; remove one")
        usual = template.deck.quantity(name)
        try:
            numbers[name] = _read(value, usual, GIVEN)
        except NlsError as error:
            raise error.at(f"--set {name}") from None
    return numbers


def _read(text: str, usual: Quantity, source: str) -> Quantity:
    """Return a number in its unit, or a row of numbers in the unit of the template."""
    from dataclasses import replace

    if isinstance(usual.value, tuple):
        raise UnitError(
            f"'{text}'", "stands for a row of numbers", next_step="change the row in the file that is written"
        )
    return replace(parse_number(text, usual.unit), source=source)


def _inertia(
    template: DeckTemplate,
    at: MotorInertia | None,
    numbers: dict[str, Quantity],
    text: str | None,
    place: str | None,
) -> dict[str, Quantity]:
    """Return the inertia of the motor as its component takes it."""
    from ..components import GIVEN

    if text is None and place is None:
        return {} if at is None else template.carried(at, numbers)
    if text is None or place is None:
        raise click.UsageError(
            "--inertia and --inertia-at belong together: an inertia, and where it is given"
        )
    if at is None:
        raise click.UsageError(f"template {template.name} has no motor with a gear; leave --inertia out")
    ratio = numbers.get(at.ratio, template.deck.quantity(at.ratio))
    try:
        given = _read(text, template.deck.quantity(at.name), GIVEN)
    except NlsError as error:
        raise error.at("--inertia") from None
    return template.carried(at, numbers) | {at.name: at.converted(given, at=place, ratio=ratio)}


def _asked_material(template: DeckTemplate) -> str | None:
    from ..components import material_laws

    if not template.materials():
        return None
    usual, known = next(iter(template.materials().values())), list(material_laws())
    click.echo(f"Rubber of the library, with an elastic law: {', '.join(known)}")

    def read(text: str) -> str:
        if text not in known:
            near = nearest(text, known)
            raise click.UsageError(
                f"'{text}' is none of them" + (f"; did you mean '{near}'?" if near else "")
            )
        return text

    return str(click.prompt("Rubber", default=usual, value_proc=read))


def _asked(
    template: DeckTemplate, at: MotorInertia | None, known: dict[str, Quantity]
) -> dict[str, Quantity]:
    """Ask for the numbers that are not given yet; the inertia last, for its ratio must be known."""
    from ..components import AskedNumber

    questions = [question for question in template.questions() if question.name not in known]
    click.echo("Press return to take the usual value; a number without a unit is in the unit that is shown.")
    answers: dict[str, Quantity] = {}
    about = None
    for question in questions:
        if at is not None and question.name == at.name:
            about = question
            continue
        if at is not None:
            usual = template.carried(at, {**known, **answers}).get(question.name, question.usual)
            question = AskedNumber(question.name, question.meaning, usual)
        answers |= _answer(question)
    if about is not None and at is not None:
        ratio = {**known, **answers}.get(at.ratio, template.deck.quantity(at.ratio))
        carried = template.carried(at, {**known, **answers})
        usual = carried.get(at.name, about.usual)
        answers |= carried | _asked_inertia(AskedNumber(about.name, about.meaning, usual), at, ratio)
    return answers


def _answer(question: AskedNumber) -> dict[str, Quantity]:
    from ..components import GIVEN

    usual = question.usual

    def read(text: str) -> Quantity | None:
        if text == str(usual):
            return None
        try:
            number, unit = split_number(text)
            if not unit and not same_dimension("1", usual.unit):
                text = f"{number!r} {usual.unit}"
            return _read(text, usual, GIVEN)
        except NlsError as error:
            raise click.UsageError(str(error)) from None

    unit = typeset_unit(usual.unit)
    label = f"{question.meaning} ({unit})" if unit else question.meaning
    answer = click.prompt(label, default=str(usual), value_proc=read)
    return {} if answer is None else {question.name: answer}


def _asked_inertia(question: AskedNumber, at: MotorInertia, ratio: Quantity) -> dict[str, Quantity]:
    """Ask where an inertia is given, then how large it is there, and convert it."""
    from dataclasses import replace

    click.echo(f"Data sheets give the inertia of the rotor; at the output it is {ratio}^2 times as large.")
    place = click.prompt("Inertia given at", type=click.Choice([ROTOR, OUTPUT]), default=ROTOR)
    factor = 1.0 if place == at.place else ratio.number**2 if at.place == ROTOR else ratio.number**-2
    unit = "g*cm^2" if place == ROTOR else "kg*m^2"
    usual = Quantity(float(f"{question.usual.number * factor:.4g}"), unit, question.usual.source)
    answer = _answer(replace(question, usual=usual))
    if not answer:
        return {}
    return {at.name: at.converted(answer[question.name], at=place, ratio=ratio)}


_NEEDS = {"design": "a target", "fit": "records", "diagnose": "records"}
"""What a command asks for besides a deck."""


def shown_command(command: str) -> str:
    """Return a command with what else it asks for, as ``fit (with records)``."""
    return f"{command} (with {_NEEDS[command]})" if command in _NEEDS else command
