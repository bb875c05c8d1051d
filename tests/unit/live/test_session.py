"""What a session does besides answering a drag: long work, records, files, saving, all kinds of edits."""

from __future__ import annotations

import asyncio
import io
import json
import random
import subprocess
import zipfile
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import nlsdesign as nls
from nlsdesign.bench.identification import load_records
from nlsdesign.design import RubberStock, tolerance_analysis
from nlsdesign.design.statics.equilibrium import equilibrium_torque
from nlsdesign.foundation.deck import read_deck
from nlsdesign.foundation.errors import NlsError
from nlsdesign.foundation.locations import folder
from nlsdesign.foundation.rubber_library import materials
from nlsdesign.live.edits import change_limit, edit
from nlsdesign.live.gallery import gallery_question
from nlsdesign.live.sessions import Uploads
from nlsdesign.live.work import _stock
from tests.command_line import Run, run
from tests.live_session import Message, Session, as_csv, bench_records, session
from tests.unit.bench.identification.test_tables import WRITERS

__all__ = ["run"]


@pytest.fixture(scope="module")
def quiet() -> Iterator[None]:
    """No whole design begins while the hand rests: it is tested on its own, and takes seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nlsdesign.live.session_news._REST", 1e9)
        yield


@pytest.fixture(scope="module")
def begun(quiet: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    with session("", tmp_path_factory.mktemp("session")) as one:
        yield one


@pytest.fixture
def one(begun: Session) -> Session:
    """The session as it began, but for what it was asked to compute."""
    for work in ("ToleranceCloud", "TorqueLoop", "DiagnoseRecords", "TryStock"):
        begun.work(work, stop=True, over=False)
    while shown(begun)["controls"]["can_undo"]:
        begun.ask(what="step", back=True)
    return begun


def shown(one: Session) -> Message:
    """The present answer."""
    one.ask(what="show")
    return dict(one.until(lambda each: each["what"] == "answer")["answer"])


def numbers(answer: Message) -> dict[str, float]:
    return {each["name"]: each["value"] for each in answer["design"]["numbers"]}


def rows(answer: Message) -> dict[str, list[float]]:
    return {each["name"]: each["values"] for each in answer["design"]["columns"]}


# --- tolerance cloud and torque loop --------------------------------------------------------------


@pytest.mark.slow
def test_the_cloud_is_the_tolerance_analysis_of_the_design_that_is_shown(one: Session) -> None:
    news = one.work("ToleranceCloud")
    assert news["state"] == "done", news["message"]
    assert news["stages"][-1] == "computes 200 made springs"
    live = one.live
    expected = tolerance_analysis(live.shown.machine, target=live.question.target, draws=200, seed=1)
    cloud = news["value"]
    np.testing.assert_allclose(cloud["band"], expected.band, rtol=1e-9)
    np.testing.assert_allclose(cloud["errors"], expected.errors, rtol=1e-9)
    low, middle, high = (np.array(row) for row in cloud["band"])
    inside = np.abs(cloud["angles"]) > 0.1
    assert np.all((low < middle)[inside])
    assert np.all((middle < high)[inside])
    assert (news["old"], news["revision"]) == (False, shown(one)["revision"])
    point = live.question.points[2]
    one.edit("MovePoint", index=2, angle=point.angle, torque=1.02 * point.torque)
    assert one.news("ToleranceCloud", lambda work: work["old"])["value"] == cloud


def test_work_that_is_stopped_gives_nothing_and_another_kind_is_refused(one: Session) -> None:
    assert one.work("ToleranceCloud", over=False)["work"]["state"] == "computing"
    stopped = one.work("ToleranceCloud", stop=True, over=False)["work"]
    assert (stopped["state"], stopped["value"]) == ("cancelled", None)
    refused = one.ask(what="work", name="ToleranceClod")
    assert "ToleranceCloud" in refused["reason"]


def test_an_earlier_design_is_neither_kept_nor_held_against_the_target_of_now(one: Session) -> None:
    answer = one.edit("ChangeLimit", limit="MaximumStress", value=2e3)["answer"]
    assert (answer["state"], answer["stale"]) == ("infeasible", True)
    assert "earlier design" in one.ask(what="work", name="ToleranceCloud")["reason"]
    assert "earlier question" in one.ask(what="keep", name="this one")["reason"]
    name, content = one.file("deck")
    assert name.startswith("last_good_")
    head, *rest = content.decode().splitlines()
    assert head == (
        "# Last good design, of an earlier question: the question of now has no design (infeasible)"
    )
    assert nls.declare(read_deck("\n".join(rest), Path(name))) is not None
    one.ask(what="step", back=True)
    assert not one.file("deck")[0].startswith("last_good_")
    kept = one.ask(what="keep", name="this one")["kept"]
    assert [each["name"] for each in kept] == ["this one"]
    assert one.ask(what="keep", name="this one", forget=True)["kept"] == []


def loop(one: Session, angle: float, state: str) -> Message:
    """What the page is told of the torque loop at an angle once it is so far."""
    one.ask(what="angle", angle=angle)
    at = one.until(lambda each: each["what"] == "at" and each["at"].get("loop", {}).get("state") == state)
    return dict(at["at"]["loop"])


@pytest.mark.slow
def test_the_loop_is_that_of_the_angle_and_of_the_design(one: Session) -> None:
    assert loop(one, 0.3, "asked for later")["value"] is None
    assert one.work("TorqueLoop")["state"] == "done"
    there, further = loop(one, 0.3, "done"), loop(one, 0.9, "done")
    for each in (there, further):
        assert each["value"]["stable"]
        assert each["value"]["magnitude"][0] == pytest.approx(0.0, abs=0.3), "it holds a torque that rests"
        # The rate of the desired torque is fed forward, so at 12 Hz the answer has not fallen.
        frequencies, sizes = each["value"]["frequencies"], each["value"]["magnitude"]
        assert abs(float(np.interp(12.0, frequencies, sizes))) < 3.0
    assert there["value"]["magnitude"] != further["value"]["magnitude"]
    assert "17.1°" in there["message"] or "of 41 angles" in there["message"]
    one.edit("SetNumber", name="spring.rubber.area", value=55e-6)
    loop(one, 0.3, "asked for later")
    one.ask(what="step", back=True)
    assert loop(one, 0.3, "done")["value"] == there["value"], "the design of before has its loop"


@pytest.mark.slow
def test_what_was_computed_of_a_quick_answer_is_not_shown_beside_the_checked_one(
    quiet: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both have one revision; the whole design may be another."""
    with session("", tmp_path) as one:
        one.work("ToleranceCloud")
        one.work("TorqueLoop")
        monkeypatch.setattr("nlsdesign.live.session_news._REST", 0.0)
        one.ask(what="show")
        one.until(lambda each: each["what"] == "answer" and each["answer"]["source"] == "full")
        assert one.news("ToleranceCloud", lambda work: work["state"] == "done" and work["old"])
        loop(one, 0.3, "asked for later")
        assert not one.work("ToleranceCloud")["old"]


# --- bench records --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def suspect() -> dict[str, dict[str, np.ndarray]]:
    """Records that turn further than the cam: a diagnosis ends with them before it tries anything."""
    return bench_records(gallery_question("cam-actuator").actuator, amperes=15.0)


def put(one: Session, files: dict[str, bytes]) -> None:
    """Hand files over, in place of those before."""

    async def part(content: bytes) -> AsyncIterator[bytes]:
        yield content

    async def keep() -> None:
        for name, content in files.items():
            await uploads.keep(name, part(content), len(content))

    uploads = Uploads(one.folder)
    for file in one.folder.glob("*"):
        file.unlink()
    asyncio.run(keep())


def test_a_diagnosis_belongs_to_its_records_and_to_its_machine(
    one: Session, suspect: dict[str, dict[str, np.ndarray]]
) -> None:
    assert "must be 1 to 60 files" in one.ask(what="work", name="DiagnoseRecords")["reason"]
    put(one, {f"{name}.csv": as_csv(columns) for name, columns in suspect.items()})
    one.ask(what="show")
    assert one.news("DiagnoseRecords", lambda work: True)["files"] == ["run1.csv", "run2.csv", "run3.csv"]
    assert one.work("DiagnoseRecords", over=False)["work"]["state"] == "computing"
    stopped = one.work("DiagnoseRecords", stop=True, over=False)["work"]
    assert (stopped["state"], stopped["old"]) == ("cancelled", False)
    # The target is no part of the machine; a number that is held is.
    one.edit("MovePoint", index=2, angle=0.41, torque=0.17)
    one.ask(what="show")
    assert not one.news("DiagnoseRecords", lambda work: True)["old"]
    one.edit("SetNumber", name="spring.rubber.area", value=55e-6)
    one.news("DiagnoseRecords", lambda work: work["old"])
    one.ask(what="step", back=True)
    one.news("DiagnoseRecords", lambda work: not work["old"])
    put(one, {"run9.csv": as_csv(suspect["run1"])})
    one.ask(what="show")
    assert one.news("DiagnoseRecords", lambda work: work["old"])["files"] == ["run9.csv"]


@pytest.mark.slow
def test_a_verdict_comes_with_its_stages_its_gap_and_its_reason(
    one: Session, suspect: dict[str, dict[str, np.ndarray]]
) -> None:
    put(one, {f"{name}.csv": as_csv(columns) for name, columns in suspect.items()})
    news = one.work("DiagnoseRecords")
    assert (news["state"], news["value"]["verdict"], news["old"]) == ("done", "data_suspect", False)
    assert "reads the records" in news["stages"]
    assert "the declared cam ends at" in news["value"]["words"]
    gap = news["value"]["gap"]
    assert gap["role"] == "held_out"
    assert gap["before"] > 10.0 * gap["noise_floor"]
    put(one, {"run9.csv": b"nothing\n"})
    failed = one.work("DiagnoseRecords")
    assert failed["state"] == "failed"
    assert "run9.csv" in failed["message"]


def test_records_are_the_same_in_every_format_that_is_taken(
    one: Session, suspect: dict[str, dict[str, np.ndarray]], tmp_path: Path
) -> None:
    columns, model = suspect["run1"], nls.flatten(gallery_question("cam-actuator").actuator)
    put(one, {"run1.csv": as_csv(columns)})
    expected = load_records(one.folder, model).records[0].trace
    for ending, write in WRITERS.items():
        write(tmp_path / f"run1{ending}", columns)
        put(one, {f"run1{ending}": (tmp_path / f"run1{ending}").read_bytes()})
        trace = load_records(one.folder, model).records[0].trace
        np.testing.assert_array_equal(trace["motor_encoder.reading"], expected["motor_encoder.reading"])
        np.testing.assert_array_equal(trace["motor.current"], expected["motor.current"])


def test_no_record_takes_the_place_of_another_unseen_and_names_stay_those_of_the_mapping(
    one: Session, suspect: dict[str, dict[str, np.ndarray]]
) -> None:
    text = as_csv(suspect["run1"])
    for first, second in (("Ä.csv", "Ö.csv"), ("run 1.csv", "run_1.csv"), ("a.toml", "b.toml")):
        with pytest.raises(NlsError, match="would take the place of"):
            put(one, {first: text, second: text})
    mapping = b'held_out = ["sine_2.0Hz"]\n'
    put(one, {"sine_0.5Hz.csv": text, "sine_2.0Hz.csv": text, "records.toml": mapping})
    records = load_records(one.folder, nls.flatten(gallery_question("cam-actuator").actuator)).records
    assert {each.name: each.role for each in records} == {"sine_0.5Hz": "fit", "sine_2.0Hz": "held_out"}


# --- files ----------------------------------------------------------------------------------------


def test_a_damaged_file_leaves_the_design_that_is_open(one: Session) -> None:
    before = one.edit("MovePoint", index=2, angle=0.41, torque=0.17)["answer"]
    name, content = one.file("design")
    assert name == "design.zip"
    chance = random.Random(3)
    for _ in range(20):
        damaged = bytearray(content)
        damaged[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        cut = bytes(damaged[: chance.randrange(4, len(content))])
        assert one.open(cut), "a file that was cut off was taken"
    assert "no archive" in one.open(b"PK not an archive")
    now = shown(one)
    assert now["controls"]["points"] == before["controls"]["points"]
    assert now["controls"]["can_undo"]
    assert numbers(now) == numbers(before)


def test_opening_is_one_step_that_goes_back_and_forth(one: Session) -> None:
    before = one.edit("MovePoint", index=2, angle=0.41, torque=0.17)["answer"]
    text = one.file("deck")[1].decode()
    name = next(line for line in text.splitlines() if line.startswith("name = "))
    assert one.open(text.replace(name, 'name = "another"').encode()) == ""
    there = shown(one)
    assert (there["state"], there["controls"]["title"]) == ("solved", "another")
    assert there["revision"] > before["revision"]
    back = one.ask(what="step", back=True)["answer"]
    assert back["controls"]["points"] == before["controls"]["points"]
    assert numbers(back) == numbers(before)
    again = one.ask(what="step", back=False)["answer"]
    assert (again["controls"]["title"], numbers(again)) == ("another", numbers(there))


@pytest.mark.slow
def test_a_saved_design_comes_back_with_its_numbers_and_without_work_of_the_one_before(
    quiet: None, tmp_path: Path
) -> None:
    with session("", tmp_path) as one:
        one.edit("SetNumber", name="spring.rubber.area", value=55e-6)
        before = one.edit("MovePoint", index=2, angle=0.41, torque=0.17)["answer"]
        _, content = one.file("design")
        one.ask(what="step", back=True)
        one.work("ToleranceCloud")
        one.ask(what="keep", name="this one")
        assert one.open(content) == ""
        assert one.news("ToleranceCloud", lambda work: work["state"] == "not begun")["value"] is None
        assert [each["name"] for each in one.until(lambda each: each["what"] == "kept")["kept"]] == [
            "this one"
        ]
        again = shown(one)
    assert again["controls"]["points"] == before["controls"]["points"]
    for name, value in numbers(before).items():
        assert numbers(again)[name] == pytest.approx(value, rel=1e-6)
    np.testing.assert_allclose(rows(again)["torque"], rows(before)["torque"], rtol=1e-4, atol=1e-6)


def test_the_deck_of_a_design_is_sound_and_repeats_its_torque(one: Session, run: Run, tmp_path: Path) -> None:
    answer = one.edit("MovePoint", index=2, angle=0.41, torque=0.17)["answer"]
    name, content = one.file("deck")
    (tmp_path / name).write_bytes(content)
    status, out, err = run("deck", "check", name)
    assert status == 0, err
    assert "no problem" in out
    machine = nls.declare(nls.load_deck(str(tmp_path / name)))
    columns = rows(answer)
    torque = equilibrium_torque(nls.flatten(machine), "spring", columns["angle"])
    # The quick answer sees the nodes of the contour, and knots of the rubber rounded.
    np.testing.assert_allclose(torque, columns["torque"], atol=2e-3 * max(columns["torque"]))
    for name, value in numbers(answer).items():
        assert machine.quantities()[name].number == pytest.approx(value, rel=1e-6)


def test_a_file_that_cannot_be_made_is_refused_in_words(one: Session) -> None:
    assert "dxf" in one.server(what="file", kind="dwg")["refused"]


@pytest.mark.slow
def test_drawings_code_and_unit_of_a_design_are_sound(one: Session, tmp_path: Path) -> None:
    """Read by others: ezdxf, an XML parser, the C compiler with the code's own test, fmpy."""
    from fmpy.validation import validate_fmu

    ezdxf = pytest.importorskip("ezdxf")
    reach = 1e3 * max(rows(shown(one))["radius"])
    for kind in ("dxf", "svg", "c", "fmu"):
        name, content = one.file(kind)
        (tmp_path / name).write_bytes(content)
    drawing = ezdxf.readfile(tmp_path / "cam.dxf")
    assert not drawing.audit().errors
    edges = [each for each in drawing.modelspace() if each.dxf.layer == "EDGE"]
    corners = np.array([point[:2] for each in edges for point in each.get_points()])
    # The edge is beside the curve of the cable's centre, by half of its 0.9 mm, and runs out of it.
    assert np.hypot(*corners.T).max() == pytest.approx(reach, abs=0.9)
    assert ElementTree.parse(tmp_path / "cam.svg").getroot().tag.endswith("svg")
    with zipfile.ZipFile(tmp_path / "observer_and_controller.zip") as archive:
        archive.extractall(tmp_path)
    sources = sorted(str(each) for each in tmp_path.glob("*.c"))
    assert len(sources) == 2
    words = ["-std=c99", "-Wall", "-Wextra", "-Werror", *sources, "-lm", "-o", str(tmp_path / "selftest")]
    subprocess.run(["gcc", *words], check=True, timeout=120)
    subprocess.run([str(tmp_path / "selftest")], check=True, timeout=60)
    assert validate_fmu(str(tmp_path / "plant.fmu")) == []


@pytest.mark.slow
def test_every_file_of_an_earlier_design_says_so_in_its_head(one: Session, tmp_path: Path) -> None:
    from fmpy import read_model_description
    from fmpy.validation import validate_fmu

    one.edit("ChangeLimit", limit="MaximumStress", value=2e3)
    words = "Last good design, of an earlier question: the question of now has no design (infeasible)"
    for kind in ("svg", "dxf"):
        name, content = one.file(kind)
        assert name == f"last_good_cam.{kind}"
        assert words in content.decode()
    name, content = one.file("c")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        for each in archive.namelist():
            assert archive.read(each).decode().startswith(f"/* {words} */\n")
        archive.extractall(tmp_path)
    sources = [str(each) for each in sorted(tmp_path.glob("*.c"))]
    subprocess.run(["gcc", "-std=c99", "-Werror", *sources, "-lm", "-o", str(tmp_path / "t")], check=True)
    name, content = one.file("fmu")
    (tmp_path / name).write_bytes(content)
    assert name == "last_good_plant.fmu"
    assert read_model_description(str(tmp_path / name)).description.startswith(words)
    assert validate_fmu(str(tmp_path / name)) == []


@pytest.mark.slow
def test_a_saved_design_is_designed_again_by_the_command_line(one: Session, run: Run, tmp_path: Path) -> None:
    answer = one.edit("MovePoint", index=2, angle=0.41, torque=0.17)["answer"]
    with zipfile.ZipFile(io.BytesIO(one.file("design")[1])) as archive:
        archive.extractall(tmp_path)
    # As its first line says.
    head = (tmp_path / "design.toml").read_text(encoding="utf-8").splitlines()[0]
    program, *words = head.split("`")[1].split()
    assert program == "nlsdesign"
    status, out, err = run(*words, "--draws", "0", "--json", "--out", "out")
    assert status == 0, err
    error = json.loads(out)["torque_error_rms"]
    assert error == pytest.approx(answer["design"]["rms_error"], abs=1e-3 * max(rows(answer)["torque"]))


# --- what can be bought, and tasks of one's own ---------------------------------------------------


def tried(one: Session, **fields: Any) -> Message:
    first = one.ask(what="stock", **fields)
    if first["what"] == "refused":
        return first
    return one.news("TryStock", lambda work: work["state"] != "computing")


@pytest.mark.slow
def test_a_stock_is_designed_and_one_of_it_taken(one: Session) -> None:
    news = tried(one, rubbers=False, size=AREA, values=[4e-5, 5e-5])
    assert news["state"] == "done", news["message"]
    labels = [row[0] for row in news["value"]["rows"]]
    assert labels == [f"{AREA} = 40 mm²", f"{AREA} = 50 mm²"]
    assert all(met and rms < 1e-3 for _, rms, met, _ in news["value"]["rows"])
    one.edit("FreeNumber", name=AREA)
    taken = one.ask(what="stock", take=1)["answer"]
    size = next(each for each in taken["controls"]["numbers"] if each[0] == AREA)
    assert (size[1], size[4]) == (pytest.approx(5e-5), False), "held at what was bought"
    assert "chosen from the stock" in size[7]
    assert "is not there" in one.ask(what="stock", take=7)["reason"]


def test_what_follows_from_a_rubber_is_not_asked_of_another(one: Session) -> None:
    """The strength of the declared rubber is no limit of one that is bought."""
    asked = edit(change_limit, "MaximumCamRadius", 0.05).applied(one.live.question)
    assert "MaximumStress" in asked.limit_values
    _, (_, _, _, keep, _, _) = _stock(asked, None, (RubberStock(("PMC-770",)),))
    assert {type(each).__name__ for each in keep} == set(asked.limits)


# Quicker: the test of a size above.
@pytest.mark.slow
def test_rubbers_of_the_library_are_a_stock(one: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    known = {
        name: each for name, each in materials().items() if name in ("PMC-770", "Dragon_Skin_30", "EPDM")
    }
    monkeypatch.setattr("nlsdesign.live.session_design.materials", lambda: known)
    assert [row[0] for row in tried(one, rubbers=True)["value"]["rows"]] == [
        "rubber of PMC-770", "rubber of Dragon_Skin_30"
    ]  # fmt: skip
    assert one.ask(what="stock", take=1)["answer"]["controls"]["material"] == "Dragon_Skin_30"


def test_a_stock_that_is_none_is_refused(one: Session) -> None:
    for fields, words in (
        ({"rubbers": False}, "is empty"),
        ({"size": AREA, "values": []}, "is an empty list"),
        ({"size": AREA, "values": ["2"]}, "is no finite number"),
        ({"size": AREA, "values": [4e-5, 4e-5]}, "twice"),
        ({"size": "spring.rubber.aera", "values": [4e-5]}, "spring.rubber.area"),
        ({"take": True}, "was not tried"),
    ):
        assert words in one.ask(what="stock", **fields)["reason"], fields
    assert "coil" in one.open(b"number, rate [N/mm]\n1, 2.0\n", kind="coils", name="list.csv")


@pytest.mark.slow
def test_coils_of_a_list_are_a_stock(quiet: None, tmp_path: Path) -> None:
    lines = (folder("models") / "coils" / "example.csv").read_text().splitlines()
    chosen = "\n".join(line for line in lines if line.startswith(("number", "2815", "3217")))
    with session("coil_cable_drive", tmp_path) as one:
        assert shown(one)["controls"]["stock"] == ["coil"]
        assert one.open(chosen.encode(), kind="coils", name="../list.csv") == ""
        news = one.news("TryStock", lambda work: work["state"] in ("done", "failed"))
        assert news["state"] == "done", news["message"]
        rows = news["value"]["rows"]
        assert [row[0].split(" of ")[0] for row in rows] == [
            "spring.coil = no. 2815",
            "spring.coil = no. 3217",
        ]
        assert not (tmp_path.parent / "list.csv").exists()


def test_a_task_of_ones_own_is_handed_over(one: Session) -> None:
    time = np.linspace(0.0, 1.0, 51)
    swing = np.sin(2 * np.pi * time)
    rows = "\n".join(f"{t},{0.3 * s},{0.2 * s}" for t, s in zip(time, swing, strict=True))
    assert one.open(f"time_s,angle_rad,torque_Nm\n{rows}\n".encode(), kind="task", name="lift me.csv") == ""
    assert shown(one)["controls"]["tasks"] == [["lift_me.csv", 1.0, 1.0, 1.0, "own"]]
    one.edit("SetMotor", name="gear_ratio", value=20.0)
    assert one.edit("TakeGearRatio")["answer"]["controls"]["motor"] == {}
    refused = one.open(b"time_s,angle_rad\n0,0\n", kind="task", name="half.csv")
    assert "has no column 'torque'" in refused or "rows" in refused


# --- edits ----------------------------------------------------------------------------------------

AREA, LENGTH = "spring.rubber.area", "spring.rubber.rest_length"
EDITS: list[dict[str, Any]] = [
    {"edit": "MovePoint", "index": 2, "angle": 0.41, "torque": 0.17},
    {"edit": "AddPoint", "angle": 0.5, "torque": 0.21},
    {"edit": "RemovePoint", "index": 3},
    {"edit": "ChangeLimit", "limit": "MaximumStrain", "value": 1.1},
    {"edit": "DropLimit", "limit": "MaximumStrain"},
    {"edit": "SetNumber", "name": AREA, "value": 55e-6},
    {"edit": "FreeNumber", "name": AREA, "minimum": 4e-5, "maximum": 7e-5},
    {"edit": "HoldNumber", "name": AREA},
    {"edit": "FreeNumber", "name": LENGTH},
    {"edit": "HoldNumber", "name": "spring.cam.contour"},
    {"edit": "FreeNumber", "name": "spring.cam.contour"},
    {"edit": "ChooseMaterial", "material": "Dragon_Skin_30"},
    {"edit": "SetTask", "index": 0, "joint": "ankle", "body_mass": 75.0},
    {"edit": "SetMotor", "name": "resistance", "value": 0.3},
    {"edit": "FollowTasks"},
    {"edit": "DropTask", "index": 0},
    {"edit": "ChooseDeck", "name": "one-sided-finger"},
]


def there_and_back(one: Session, edits: list[dict[str, Any]]) -> None:
    """Each step back and each step forth shows what was shown, to the last digit."""
    moments = [shown(one)]
    for fields in edits:
        answer = one.ask(what="edit", edit=fields)
        assert answer["what"] == "answer", answer
        moments.append(answer["answer"])
    for back, order in ((True, reversed(moments[:-1])), (False, iter(moments[1:]))):
        for expected in order:
            there = one.ask(what="step", back=back)["answer"]
            for name in ("state", "message", "conflicts", "stale"):
                assert there[name] == expected[name], name
            asked = {n: v for n, v in there["controls"].items() if not n.startswith("can_")}
            assert asked == {n: v for n, v in expected["controls"].items() if not n.startswith("can_")}
            assert {**there["design"], "revision": 0} == {**expected["design"], "revision": 0}
        assert there["controls"]["can_redo" if back else "can_undo"]
        assert not there["controls"]["can_undo" if back else "can_redo"]


def test_steps_back_and_forth_over_edits_of_one_program(one: Session) -> None:
    there_and_back(one, [EDITS[0], EDITS[5], EDITS[6], EDITS[7]])


@pytest.mark.slow
def test_steps_back_and_forth_over_every_kind_of_edit(one: Session) -> None:
    there_and_back(one, EDITS)
