"""Design files: what they say, and what is said of a bad one."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.design import (
    AtMost,
    ExponentialTorque,
    LeastRubber,
    LeastSize,
    MaximumCamRadius,
    MaximumStrain,
    MaximumStress,
    NumberRange,
    OverTravel,
    RubberStock,
    Stock,
    TabulatedTorque,
    TaskTarget,
    TorqueBand,
    TorqueError,
    TorqueWithin,
    job_of,
    read_job,
)
from nlsdesign.foundation.errors import DeckError, NlsError, UnitError, UnknownNameError, ValueRangeError
from nlsdesign.foundation.quantity import degrees, quantity

WHOLE = """
free = ["spring.cam.contour", "spring.pretension"]
spring = "spring"

[target]
ExponentialTorque = {maximum = "5 N*m", angle = "53 deg", shape = 1.0, tolerance = "20 mN*m"}

[limits]
MaximumCamRadius = {radius = "20 mm"}
MaximumStress = {stress = "5.17 MPa", safety_factor = 2.5}
NumberRange = [
  {name = "spring.pretension", minimum = "1 mm", maximum = "8 mm"},
  {name = "spring.rubber.area", minimum = "20 mm^2", maximum = "200 mm^2"},
]
OverTravel = {angle = "5 deg", limits = {MaximumStrain = {strain = 1.2}}}
TorqueWithin = {band = {angles = [0.0, 0.5, 1.0], lower = [0.0, 1.0, 4.0], upper = [0.1, 2.0, 6.0]}}

[goals]
TorqueError = {}
LeastRubber = {weight = 0.01}

[stock]
"spring.rubber.rest_length" = ["10 mm", "12.5 mm"]
rubber = ["PMC-770", "Dragon_Skin_30"]

[tolerance]
draws = 60

[search]
starts = 12
seed = 3
largest_error = "0.5 %"
"""


def test_a_file_says_what_the_objects_say() -> None:
    job = job_of(WHOLE, Path("job.toml"))
    target = job.target
    assert isinstance(target, ExponentialTorque)
    assert target.last_angle == pytest.approx(degrees(53.0))
    assert target.band([0.5])[1] - target.torque([0.5]) == pytest.approx(0.02)
    assert job.keep[0] == MaximumCamRadius(0.02)
    assert job.keep[1] == MaximumStress(5.17e6, safety_factor=2.5)
    assert job.keep[2] == NumberRange("spring.pretension", 1e-3, 8e-3)
    assert job.keep[3] == NumberRange("spring.rubber.area", quantity(20.0, "mm^2"), quantity(200.0, "mm^2"))
    assert job.keep[4] == OverTravel(degrees(5.0), limits=(MaximumStrain(1.2),))
    band = TorqueBand(angles=(0.0, 0.5, 1.0), lower=(0.0, 1.0, 4.0), upper=(0.1, 2.0, 6.0))
    assert job.keep[5] == TorqueWithin(band)
    assert job.goals == (TorqueError(), LeastRubber(weight=0.01))
    assert job.free is not None
    assert job.free[:2] == ("spring.cam.contour", "spring.pretension")
    stock, rubber = job.free[2:]
    assert isinstance(stock, Stock)
    assert [float(getattr(value, "number", value)) for value in stock.values] == [0.01, 0.0125]
    assert rubber == RubberStock(("PMC-770", "Dragon_Skin_30"))
    assert (job.settings.starts, job.settings.seed, job.settings.largest_error) == (12, 3, 0.005)
    assert job.settings.draws == 60
    assert job.spring == "spring"


def test_a_target_may_be_a_table_beside_the_file(tmp_path: Path) -> None:
    rows = "angle [deg],torque [N*m]\n0,0\n20,1\n40,3\n50,4.5\n"
    (tmp_path / "curve.csv").write_text(rows, encoding="utf-8")
    (tmp_path / "job.toml").write_text('[target]\nfile = "curve.csv"\n', encoding="utf-8")
    job = read_job(tmp_path / "job.toml")
    assert isinstance(job.target, TabulatedTorque)
    assert job.target.last_angle == pytest.approx(degrees(50.0))
    assert job.free is None


def test_a_goal_may_stand_in_a_limit() -> None:
    text = WHOLE.replace("[goals]", 'AtMost = {of = {LeastSize = {}}, value = "19 mm"}\n\n[goals]')
    assert job_of(text, Path("job.toml")).keep[-1] == AtMost(
        LeastSize(), quantity(19.0, "mm", source="asked for in the design file")
    )


def test_a_band_beside_the_target_is_kept_as_a_limit(tmp_path: Path) -> None:
    rows = "angle [deg],torque [N*m],lower [N*m],upper [N*m]\n0,0,0,0\n20,1,0.9,1.1\n50,4,3.5,4.5\n"
    (tmp_path / "curve.csv").write_text(rows, encoding="utf-8")
    (tmp_path / "job.toml").write_text('[target]\nfile = "curve.csv"\n', encoding="utf-8")
    (limit,) = read_job(tmp_path / "job.toml").keep
    assert isinstance(limit, TorqueWithin)
    assert limit.band.upper == (0.0, 1.1, 4.5)


def test_a_target_may_follow_from_a_task() -> None:
    fields = 'joint = "ankle", body_mass = "75 kg", scale = 0.05, symmetry = {OneSidedSpring = {}}'
    text = f"[target]\nTaskTarget = {{{fields}}}\n"
    target = job_of(text, Path("job.toml")).target
    assert isinstance(target, TaskTarget)
    assert type(target.symmetry).__name__ == "OneSidedSpring"


@pytest.mark.parametrize(
    ("old", "new", "error", "words"),
    [
        ("MaximumCamRadius", "MaximumCamRadus", UnknownNameError, r"job\.toml:9:1.*mean 'MaximumCamRadius'"),
        ("radius =", "radios =", UnknownNameError, r"job\.toml:9:1.*field.*did you mean 'radius'"),
        ('"20 mm"', '"20 N"', UnitError, r"job\.toml:9:1"),
        ('"20 mm"', '"20"', UnitError, r"job\.toml:9:1.*has no unit -> give it in a unit like 'm'"),
        ('"20 mm"', "0.5", UnitError, r"job\.toml:9:1.*has no unit"),
        ('"20 mm"', '"twenty mm"', UnitError, r"radius = 'twenty mm'.*does not start with a number"),
        ("draws = 60", "drawz = 60", UnknownNameError, r"did you mean 'draws'"),
        ("draws = 60", 'draws = "many"', DeckError, r"is not a whole number"),
        ("[goals]", "[gaols]", UnknownNameError, r"did you mean 'goals'"),
        ("seed = 3", "sede = 3", UnknownNameError, r"job\.toml:\d+:1.*did you mean 'seed'"),
        ("starts = 12", "starts = 0", ValueRangeError, r"starts = 0"),
        ("draws = 60", f"draws = 0x{'f' * 4000}", ValueRangeError, r"draws = a number of thousands"),
        ('free = ["spring', 'free = "["#["spring', DeckError, r"job\.toml:2:1: free: is not a list of names"),
        ("shape = 1.0", "shape = 0.0", ValueRangeError, r"job\.toml:6:1.*straight line"),
        ('maximum = "5 N*m", ', "", DeckError, r"lacks maximum"),
        ('["10 mm", "12.5 mm"]', "[]", ValueRangeError, r"empty list"),
        ("lower = [0.0, 1.0, 4.0]", "lower = [0.0, 3.0, 4.0]", ValueRangeError, r"exchange the columns"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_place(old: str, new: str, error: type[NlsError], words: str) -> None:
    assert old in WHOLE
    with pytest.raises(error, match=words):
        job_of(WHOLE.replace(old, new, 1), Path("job.toml"))


def test_one_target_and_no_more() -> None:
    with pytest.raises(DeckError, match="has no target"):
        job_of('free = ["spring.cam.contour"]\n', Path("job.toml"))
    both = '[target]\nfile = "a.csv"\nPowerTorque = {coefficient = 1.0, exponent = 2.0, angle = 1.0}\n'
    with pytest.raises(DeckError, match="has 2 entries"):
        job_of(both, Path("job.toml"))
    with pytest.raises(ValueRangeError, match="a file or a joint"):
        job_of('[target]\nTaskTarget = {body_mass = "75 kg"}\n', Path("job.toml"))
    with pytest.raises(DeckError, match="cannot be read"):
        read_job("no/such/job.toml")
