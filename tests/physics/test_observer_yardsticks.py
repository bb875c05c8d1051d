"""Machine and yardsticks of ``benchmarks.observer_defaults`` against the package, which they do not use."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nlsdesign as nls
from benchmarks._default_machines import COUNTED, FREQUENCIES, PARTS, SINGLE, TIME, Course, numbers
from benchmarks.observer_defaults import coordinates, drawn, judged, kinds, known_of
from nlsdesign.model import FlatModel

DECK = "austin2015_figure_consistent"


@pytest.fixture(scope="module")
def published() -> FlatModel:
    return nls.flatten(nls.declare(nls.load_deck(DECK)))


@pytest.fixture(scope="module")
def course(published: FlatModel, tmp_path_factory: pytest.TempPathFactory) -> Course:
    return Course(published, tmp_path_factory.mktemp("machine"))


def test_the_machine_in_c_is_that_of_the_package(published: FlatModel, course: Course) -> None:
    """Both integrate the same held current over 0.4 s; the encoder in C has no counts."""
    time = TIME * np.arange(400)
    current = 9.0 * np.sin(2.0 * np.pi * 3.0 * time)
    machine = numbers(published.values)
    machine[SINGLE.index("motor_encoder.quantum")] = 0.0
    wanted, course.wanted, course.parts = course.wanted, course.wanted[:400], 100
    ours = course.run(machine, current)
    course.wanted, course.parts = wanted, PARTS
    theirs = nls.simulate(published, time, inputs={"motor.current": current}, hold=True, tolerance=1e-10)
    assert np.max(np.abs(theirs["motor.angle"])) > 0.3
    np.testing.assert_allclose(ours.angle, theirs["motor.angle"], atol=2e-6)
    np.testing.assert_allclose(ours.torque, theirs["spring.torque"], atol=2e-5)


def test_the_machine_follows_its_course_in_counts(course: Course) -> None:
    run = course.run(course.declared)
    count = course.declared[SINGLE.index("motor_encoder.quantum")]
    np.testing.assert_allclose(run.angle / count, np.round(run.angle / count), atol=1e-6)
    for part, frequency in zip(course.stretches, FREQUENCIES, strict=True):
        assert part.stop - part.start == round(COUNTED / TIME)
        assert np.max(np.abs(run.torque[part])) == pytest.approx(2.8, rel=0.1), frequency


def test_one_ratio_removes_most_of_a_wrong_section(
    published: FlatModel, course: Course, tmp_path: Path
) -> None:
    """Rubber of 10 % more section: of the error of the cascade remains what the prior leaves to the drive."""
    prior = known_of(published)
    observers = kinds(published, course, prior, tmp_path, ["cascade", "ratio"])
    machine = course.declared.copy()
    machine[SINGLE.index("spring.rubber.area")] *= 1.1
    runs = [course.run(machine), course.run(course.declared)]
    alone, learned = (judged(course, observer, runs)[0] for observer in observers.values())
    assert np.all(learned[0] < 0.6 * alone[0])
    assert np.all(learned[1] < 1.5 * alone[1])


def test_draws_are_those_of_the_deck(published: FlatModel, course: Course) -> None:
    prior = known_of(published)
    drive = SINGLE.index("drive")
    x = coordinates(prior, 400, 3)
    factors = np.array([drawn(course, prior, each)[drive] for each in x]) / course.declared[drive]
    assert float(np.std(np.log(factors))) == pytest.approx(np.log(1.1), rel=0.1)
