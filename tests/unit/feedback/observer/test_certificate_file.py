"""Files of proof: a touched character fails, and what is unreadable is said to be."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nlsdesign.feedback.observer import read_certificate, verify
from nlsdesign.feedback.observer.certificates.exact import exact, exponential_below, is_positive_definite
from nlsdesign.feedback.observer.certificates.intervals import enclose
from nlsdesign.foundation.errors import ArrangementError, MeasurementError
from tests.command_line import Run, run

__all__ = ["run"]  # the fixture

DECK = "austin2015_stiff_spring"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from click.testing import CliRunner

    from nlsdesign.cli.main import program

    place = tmp_path_factory.mktemp("certified")
    words = ["observer", "--deck", DECK, "--certificate", "--real", "float", "--out", str(place)]
    result = CliRunner().invoke(program, words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    assert "for every sequence of measured angles and every current" in result.output
    return place


def test_a_certificate_holds_for_its_deck_and_its_code(folder: Path, run: Run) -> None:
    status, out, _ = run(
        "observer", "verify", str(folder / "certificate.json"), "--deck", DECK, "--c", str(folder)
    )
    assert status == 0
    assert out.count("\nholds: ") == 7
    assert out.rstrip().endswith("the certificate holds")


def test_another_deck_and_another_c_file_fail(folder: Path, run: Run, tmp_path: Path) -> None:
    certificate = str(folder / "certificate.json")
    status, out, _ = run("observer", "verify", certificate, "--deck", "austin2015_soft_spring")
    assert status == 1
    assert "DOES NOT HOLD: deck" in out
    for name in ("observer.c", "observer.h"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    text = (tmp_path / "observer.c").read_text()
    entry = re.search(r"\{(-?\d+\.\d)(\d)", text)
    assert entry is not None
    digit = str((int(entry.group(2)) + 1) % 10)
    (tmp_path / "observer.c").write_text(text[: entry.start(2)] + digit + text[entry.end(2) :])
    status, out, _ = run("observer", "verify", certificate, "--c", str(tmp_path), "--json")
    assert status == 1
    assert [c["name"] for c in json.loads(out)["checks"] if c["holds"] is False] == ["C code"]


@settings(max_examples=settings.default.max_examples // 2, deadline=None)
@given(data=st.data())
def test_any_touched_digit_fails(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Of P, of an assumption, of a hash, of the deck, of a sentence: refused, or said to be unreadable."""
    text = (folder / "certificate.json").read_text(encoding="utf-8")
    places = [m.start() for m in re.finditer(r"\d", text)]
    place = data.draw(st.sampled_from(places))
    digit = data.draw(st.sampled_from([d for d in "0123456789" if d != text[place]]))
    path = tmp_path_factory.mktemp("touched") / "certificate.json"
    path.write_text(text[:place] + digit + text[place + 1 :], encoding="utf-8")
    try:
        certificate, untouched = read_certificate(path)
    except MeasurementError:
        return  # no longer a certificate at all, which is exit status 2
    assert not untouched
    assert not verify(certificate, untouched=untouched).holds


@pytest.mark.parametrize("place", ["moving", "seen"])
def test_an_index_of_no_state_is_unreadable(folder: Path, tmp_path: Path, place: str) -> None:
    content = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))
    content["polytope"][place][0] = len(content["polytope"]["states"])
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(MeasurementError, match="an index names a state or a column that there is not"):
        read_certificate(path)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: "",
        lambda text: text[:-40],
        lambda text: text.replace("certificate 1", "certificate 9"),
        lambda text: re.sub(r'"decay": [^,]+', '"decay": NaN', text),
        lambda text: re.sub(r'"lyapunov": \[', '"lyapunov": [1.0, ', text),
    ],
)
def test_what_is_no_certificate_is_named(
    spoil: Callable[[str], str], folder: Path, tmp_path: Path, run: Run
) -> None:
    path = tmp_path / "spoilt.json"
    path.write_text(spoil((folder / "certificate.json").read_text(encoding="utf-8")), encoding="utf-8")
    status, out, err = run("observer", "verify", str(path))
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert "spoilt.json" in err
    assert len(err.strip().splitlines()) == 1


def test_a_decay_out_of_reach_writes_nothing(run: Run, tmp_path: Path) -> None:
    status, _, err = run(
        "observer", "--deck", DECK, "--certificate", "--decay", "900", "--out", str(tmp_path / "o")
    )
    assert status == 2
    assert "the fastest that is proved is" in err
    assert not (tmp_path / "o").exists()


# --- the arithmetic that decides --------------------------------------------------------------------


@settings(max_examples=settings.default.max_examples // 2, deadline=None)
@given(
    low=st.tuples(*[st.floats(-3.0, 3.0)] * 2), width=st.tuples(*[st.floats(0.0, 1.0)] * 2),
    share=st.tuples(*[st.floats(0.0, 1.0)] * 2),
)  # fmt: skip
def test_a_range_holds_every_value(
    low: tuple[float, ...], width: tuple[float, ...], share: tuple[float, ...]
) -> None:
    """Every operation that laws of the package use, at a point of the box, by CasADi."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    expressions = [
        x + y, x - y, x * y, x / (2 + y * y), x**3, ca.sqrt(1 + x * x), ca.tanh(x) * ca.exp(y),
        ca.sin(x) + ca.cos(y),
        ca.fmax(x, y) - ca.fmin(x, 0.5), ca.floor(3 * x), ca.fabs(x) * ca.sign(y),
        ca.if_else(x > y, x * y, -y),
        ca.log1p(ca.exp(x)), ca.atan(x / 0.3), ca.jacobian(ca.fmax(x, y) ** 2, x), ca.expm1(x * y), x ** (-2),
    ]  # fmt: skip
    function = ca.Function("f", [x, y], [ca.vertcat(*expressions)])
    high = [a + w for a, w in zip(low, width, strict=True)]
    at = [min(max(a + s * w, a), b) for a, w, s, b in zip(low, width, share, high, strict=True)]
    found = enclose(function, [[(low[0], high[0])], [(low[1], high[1])]]).outputs[0]
    value = np.array(function(*at)).ravel()
    seen = np.isfinite(value)
    assert np.all((found.lower[0] <= value) & (value <= found.upper[0]) | ~seen)


def test_an_operation_without_range_is_named() -> None:
    x = ca.SX.sym("x")
    with pytest.raises(ArrangementError, match="whose range is not known"):
        enclose(ca.Function("f", [x], [ca.fmod(x, 0.3)]), [[(0.0, 1.0)]])


def test_a_bound_goes_outward_to_the_next_number() -> None:
    """A square root is rounded outward by one unit, a hyperbolic sine by four."""
    x = ca.SX.sym("x")
    tiny, huge = np.nextafter(0.0, 1.0), np.finfo(float).max
    ends = np.array([0.0, -0.0, tiny, 1.0, 2.0, 0.1, huge, np.inf])
    root = enclose(ca.Function("f", [x], [ca.sqrt(x)]), [[(ends, ends)]]).outputs[0]
    exact = np.sqrt(ends)
    np.testing.assert_array_equal(root.upper[:, 0], np.nextafter(exact, np.inf))
    np.testing.assert_array_equal(root.lower[:, 0], np.maximum(np.nextafter(exact, -np.inf), 0.0))
    ends = np.array([-np.inf, -2.0, -tiny, -0.0, 0.0, tiny, 0.3, 800.0])
    with np.errstate(over="ignore"):
        low, high = np.sinh(ends), np.sinh(ends)
        for _ in range(4):
            low, high = np.nextafter(low, -np.inf), np.nextafter(high, np.inf)
    sine = enclose(ca.Function("f", [x], [ca.sinh(x)]), [[(ends, ends)]]).outputs[0]
    np.testing.assert_array_equal(sine.lower[:, 0], low)
    np.testing.assert_array_equal(sine.upper[:, 0], high)
    undefined = enclose(ca.Function("f", [x], [ca.log(x)]), [[(-1.0, -1.0)]]).outputs[0]
    assert (undefined.lower[0, 0], undefined.upper[0, 0]) == (-np.inf, np.inf)


@settings(max_examples=settings.default.max_examples // 2, deadline=None)
@given(seed=st.integers(0, 10**6), shift=st.floats(-1.0, 1.0))
def test_definiteness_is_that_of_the_eigenvalues(seed: int, shift: float) -> None:
    half = np.random.default_rng(seed).normal(size=(4, 4))
    matrix = half @ half.T + shift * np.eye(4)
    matrix = (matrix + matrix.T) / 2.0
    least = float(np.min(np.linalg.eigvalsh(matrix)))
    if abs(least) > 1e-9:
        assert is_positive_definite(exact(matrix)) == (least > 0.0)


@given(x=st.floats(0.0, 40.0))
def test_the_exponential_is_bounded_from_below_and_close(x: float) -> None:
    below = exponential_below(Fraction(x))
    assert below <= Fraction(np.exp(-x)) * (1 + Fraction(1, 10**15))
    assert float(below) == pytest.approx(np.exp(-x), rel=1e-14)


def test_one_singular_matrix_is_not_definite_by_a_hair() -> None:
    """[[1, 1], [1, 1]] is singular; what rounding would decide, fractions decide."""
    assert not is_positive_definite(exact([[1.0, 1.0], [1.0, 1.0]]))
    assert is_positive_definite(exact([[1.0, 1.0], [1.0, 1.0 + 2.0**-52]]))
    assert not is_positive_definite(exact([[1.0, 0.5], [0.4, 1.0]]))
