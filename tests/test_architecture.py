"""The house as it is: who may import whom, drawn from the source; and proof that the drawing would notice."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from tests.import_graph import Import, cycles, imports, modules

# Rooms that only gather others: their folders are the rooms.
GROUPS = ("feedback", "bench", "presentation")

# What the floors above the waist stand on: they see the flat model and never the components it came from.
WAIST = {"model"}
SIMULATED = WAIST | {"simulation"}
FEEDBACK = {"feedback.analysis", "feedback.observer", "feedback.control"}
BENCH = {"bench.identification", "bench.discrepancy", "bench.calibration"}
MIDDLE = {"design", "export", "regeneration"} | FEEDBACK | BENCH
SHOWN = {"presentation.figures", "presentation.report"}

# room: the rooms it may import, besides itself and the foundation, which is open to every room
MAY_IMPORT: dict[str, set[str]] = {
    "foundation": set(),
    "components": set(),
    "model": {"components"},
    "simulation": WAIST,
    "design": SIMULATED,
    "feedback.analysis": SIMULATED,
    "feedback.observer": SIMULATED | {"feedback.analysis"},
    "feedback.control": SIMULATED | {"feedback.analysis", "feedback.observer"},
    "bench.identification": SIMULATED,
    "bench.discrepancy": SIMULATED | {"bench.identification"},
    "bench.calibration": SIMULATED | {"bench.identification", "bench.discrepancy"},
    "export": SIMULATED,
    "regeneration": SIMULATED | FEEDBACK | BENCH | {"components", "design", "export"},
    "presentation.figures": SIMULATED | MIDDLE,
    "presentation.report": SIMULATED | MIDDLE | {"presentation.figures"},
    "sweeps": SIMULATED | MIDDLE | {"components"},
    "presentation.sweep_report": SIMULATED | {"sweeps"} | SHOWN,
    "live": SIMULATED | MIDDLE | {"components"} | SHOWN,
    "cli": SIMULATED | MIDDLE | {"components", "sweeps", "presentation.sweep_report", "live"} | SHOWN,
    "__main__": {"cli"},
    "__init__": SIMULATED | MIDDLE | {"components", "sweeps", "presentation.sweep_report", "cli"} | SHOWN,
    **{room: set() for room in GROUPS},
}

# Above the waist a flat model is enough, but for these: a design and a diagnosis give back a changed copy of
# the assembly, a measured record takes the noise of its sensors, a calibration puts the machine on a bench.
# The drawing of a cam needs its geometry; adding a missing effect means declaring the assembly again. A deck
# that lies among exported files is declared for its digest.
ASSEMBLY = "components.assembly.named_parts"
EXCEPTIONS: dict[str, tuple[str, ...]] = {
    "design": (ASSEMBLY,),
    "design.jobs.written_design": ("components.assembly.deck_writer",),
    "design.statics.equilibrium": ("components.core.element",),
    "design.optimisation.stock": ("components.assembly.library_rubber",),
    "export.exported_files": ("components.assembly.deck_writer",),
    "bench.discrepancy": (ASSEMBLY,),
    "simulation.measure": (ASSEMBLY,),
    "design.statics": ("components.transmission",),
    "bench.discrepancy.effects": ("components",),
    "bench.calibration": (ASSEMBLY,),
    "bench.calibration.bench_test": ("components",),
    "bench.calibration.calibrated_deck": ("components.assembly.deck_writer",),
    "bench.discrepancy.case": ("components",),
    "bench.discrepancy.diagnose": ("components",),
}

# The inner rooms of a room, floor by floor from the ground; a module may import its own inner room and those
# on lower floors, never a neighbour on its own floor.
FLOORS: dict[str, tuple[set[str], ...]] = {
    "components": ({"core"}, {"materials", "mechanics", "transmission", "sensing"}, {"assembly"}),
    "bench.identification": (
        {"filters", "residuals"}, {"records"}, {"equation_error", "parameters", "covariance"},
        {"least_squares", "windowed_simulation"}, {"simulation_error"}, {"multiple_shooting"},
    ),
    "bench.discrepancy": (
        {"tearing"}, {"block_prediction"}, {"fitting"}, {"effects"}, {"selection"}, {"screening", "planning"},
        {"reporting"}, {"case"}, {"diagnose"},
    ),
    "design": ({"curves"}, {"statics"}, {"tolerance", "drawing"}, {"optimisation"}, {"parametric"}, {"jobs"}),
    "feedback.observer": ({"scheduling"}, {"corrected", "certificates"}, {"spread"}),
    "feedback.control": ({"laws"}, {"closed_loop"}, {"evaluation"}, {"tuning"}),
    "export": (
        {"files"}, {"c"}, {"compilation"}, {"fmi", "cosimulation", "modelica", "mujoco"}, {"exported_files"},
    ),
}  # fmt: skip

# library: the only places that may know it
HOMES: dict[str, tuple[str, ...]] = {
    "matplotlib": ("presentation.figures",),
    "mpl_toolkits": ("presentation.figures",),
    "fmpy": ("export",),
    "ezdxf": ("design.drawing",),
    "OCP": ("design.drawing",),
    "distributed": ("foundation.work_sharing",),
    "dask": ("foundation.work_sharing",),
    "mpi4py": ("foundation.work_sharing",),
    "SALib": ("sweeps",),
    "starlette": ("live",),
    "uvicorn": ("live",),
    "control": ("model.linear", "feedback"),
    # In a wheel these are not at the top level: nlsdesign.foundation.locations.folder finds them.
    "models": (),
    "studies": (),
    "tests": (),
    "benchmarks": (),
}


# library as it is imported: its name in pyproject.toml, where they differ
DISTRIBUTIONS = {"OCP": "cadquery-ocp-novtk", "SALib": "salib"}


def inside(name: str, place: str) -> bool:
    return name == place or name.startswith(place + ".")


def room_of(package: str, module: str) -> str:
    """Room of a module: the folder in the package, or the one inside of it where the first only gathers."""
    _, *parts = module.split(".")
    return ".".join(parts[: 2 if parts[0] in GROUPS else 1]) if parts else "__init__"


def forbidden(package: Path) -> Iterator[str]:
    """Each module outside the house and each import that the rules above do not allow."""
    known = modules(package)
    for module in known:
        if room_of(package.name, module) not in MAY_IMPORT:
            yield f"{module} is in no room of the house"
        elif floor_of(package.name, module) is None:
            yield f"{module} is in no inner room of its room"
    for found in imports(package):
        reason = objection(package.name, found, known)
        if reason:
            yield f"{found}: {reason}"


def objection(package: str, found: Import, known: dict[str, Path]) -> str | None:
    """Why this import is not allowed, or None."""
    source = found.source.removeprefix(package).lstrip(".")
    target = found.target.removeprefix(package).lstrip(".")
    if not inside(found.target, package):
        homes = HOMES.get(found.target.partition(".")[0])
        if homes is None or any(inside(source, home) for home in homes):
            return None
        return "only in " + ", ".join(homes) if homes else "nowhere in the package"
    if found.target == package:
        return "the root gathers the rooms, no room may import it"
    if found.target not in known:
        return "there is no such module"
    here, there = room_of(package, found.source), room_of(package, found.target)
    if here == there:
        return indoors(package, found)
    if there in {"foundation"} | MAY_IMPORT.get(here, set()):
        return None
    if any(
        inside(source, left) and inside(target, right)
        for left, allowed in EXCEPTIONS.items()
        for right in allowed
    ):
        return None
    return f"{here} may not know {there}"


def behind_the_front(package: Path, found: Import) -> bool:
    """Whether an import reaches into a room past its front; the modules of the foundation are open to all."""
    if not inside(found.target, package.name) or found.target == package.name:
        return False
    room = room_of(package.name, found.target)
    front = f"{package.name}.{room}"
    if room in (room_of(package.name, found.source), "foundation") or found.target == front:
        return False
    # A module may be called as what the front hands out of it: ``flatten`` of ``model``.
    text = package.joinpath(*room.split("."), "__init__.py").read_text(encoding="utf-8")
    statements = [node for node in ast.parse(text).body if isinstance(node, ast.ImportFrom)]
    handed_out = {alias.asname or alias.name for node in statements for alias in node.names}
    return found.target.removeprefix(f"{front}.") not in handed_out


def floor_of(package: str, module: str) -> int | None:
    """Floor of a module within its room; -1 where the room has no inner rooms, None if it is in none."""
    room, inner = inner_room(package, module)
    if room not in FLOORS or not inner:
        return -1
    return next((k for k, floor in enumerate(FLOORS[room]) if inner in floor), None)


def inner_room(package: str, module: str) -> tuple[str, str]:
    """Room of a module, and its inner room or the module itself within the room; "" for the room's front."""
    room = room_of(package, module)
    return room, module.removeprefix(f"{package}.{room}").lstrip(".").partition(".")[0]


def indoors(package: str, found: Import) -> str | None:
    """Why an import within one room is not allowed, or None."""
    inner = [inner_room(package, name)[1] for name in (found.source, found.target)]
    if inner[0] == inner[1] or not inner[0]:  # the room's own front gathers its inner rooms
        return None
    floors = floor_of(package, found.source), floor_of(package, found.target)
    if floors == (-1, -1) or None in floors:
        return None
    if not inner[1]:
        return "an inner room may not import the front of its room"
    return None if floors[1] < floors[0] else f"{inner[0]} may not know {inner[1]}, which is not below it"  # type: ignore[operator]


def internal_cycles(package: Path) -> list[str]:
    found = imports(package)
    return cycles((edge.source, edge.target) for edge in found if inside(edge.target, package.name))


def undeclared(package: Path, project: Path) -> Iterator[str]:
    """Imports of libraries that an installation need not have."""
    table = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
    core, extra = names_in(table["dependencies"]), set()
    for requirements in table["optional-dependencies"].values():
        extra |= names_in(requirements)
    for found in imports(package):
        name = found.target.partition(".")[0]
        if name == package.name or name in sys.stdlib_module_names or name in core:
            continue
        if DISTRIBUTIONS.get(name, name) not in extra:
            yield f"{found}, which pyproject.toml does not declare"
        elif not found.lazy:
            yield f"{found}, which is optional: import it inside the function that needs it"


def expect_none(found: Iterable[str]) -> None:
    listed = list(found)
    assert not listed, "\n" + "\n".join(listed)


def names_in(requirements: list[str]) -> set[str]:
    return {re.match(r"[\w-]+", text).group().lower() for text in requirements}  # type: ignore[union-attr]


# --- the house as it is ---------------------------------------------------------------------------


def test_the_drawing_is_not_empty(root: Path) -> None:
    drawn = {(found.source, found.target) for found in imports(root / "nlsdesign")}
    assert ("nlsdesign.foundation.quantity", "nlsdesign.foundation.errors") in drawn
    assert ("nlsdesign.model.flat", "nlsdesign.foundation.quantity") in drawn


def test_no_forbidden_import(root: Path) -> None:
    expect_none(forbidden(root / "nlsdesign"))


def test_the_commands_import_from_a_room_only_its_front(root: Path) -> None:
    package = root / "nlsdesign"
    expect_none(
        f"{found}, past the front of its room"
        for found in imports(package)
        if inside(found.source, "nlsdesign.cli") and behind_the_front(package, found)
    )


@pytest.mark.parametrize(
    "text", ["..components.assembly.deck_writer import x", "..presentation.report.sections import x"]
)
def test_an_import_past_the_front_of_a_room_is_caught(tmp_path: Path, text: str) -> None:
    rooms = [
        "components/assembly/deck_writer",
        "presentation/report/sections",
        "foundation/deck",
        "model/flatten",
    ]
    fronts = {"model/__init__": "from .flatten import flatten"}
    front = (
        "from ..foundation.deck import y\n from ..presentation.report import z\n from ..model import flatten"
    )
    files = {**dict.fromkeys(rooms, ""), **fronts, "cli/deck": f"def f():\n from {text}\n {front}"}
    package = build(tmp_path, files)
    known = [found for found in imports(package) if found.source == "nlsdesign.cli.deck"]
    assert [found.line for found in known if behind_the_front(package, found)] == [2]


def test_the_waist_hands_out_no_assembly() -> None:
    import nlsdesign.model

    assert "Assembly" not in vars(nlsdesign.model)
    for name in nlsdesign.model.__all__:
        home = getattr(nlsdesign.model, name).__module__
        assert not home.startswith("nlsdesign.components"), f"{name} comes from {home}"


def test_no_cycle_among_packages_or_modules(root: Path) -> None:
    expect_none(internal_cycles(root / "nlsdesign"))


def test_every_library_is_declared(root: Path) -> None:
    expect_none(undeclared(root / "nlsdesign", root / "pyproject.toml"))


# --- the drawing notices --------------------------------------------------------------------------


def build(folder: Path, files: dict[str, str]) -> Path:
    """Write a package with these modules; every folder becomes a package."""
    package = folder / "nlsdesign"
    for name, text in {"__init__": "", **files}.items():
        file = (package / name).with_suffix(".py")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text + "\n", encoding="utf-8")
        for parent in file.relative_to(package).parents:
            (package / parent / "__init__.py").touch()
    return package


ALLOWED = {
    "foundation/errors": "",
    "components/transmission/cam": "from ...foundation.errors import X\nfrom ..core import spring\n"
    "from . import cable",
    "components/transmission/cable": "",
    "components/core/spring": "import casadi",
    "model/linear": "import control\nfrom ..components.transmission.cam import Cam",
    "feedback/analysis/sweep": "from control import StateSpace\nfrom ...model import linear",
    "feedback/observer/scheduling/gains": "from ...analysis.sweep import over",
    "feedback/control/laws/torque_loop": "import control.matlab\nfrom ...observer import gains",
    "design/statics/contour": "from ...components.transmission.cam import Cam",
    "design/optimisation/solve": "from ...components.assembly.named_parts import Assembly",
    "components/assembly/named_parts": "",
    "bench/discrepancy/effects/friction": "from ....components.core import spring",
    "export/fmi/fmu": "def check():\n    import fmpy.validation",
    "presentation/figures/cam": "import matplotlib.pyplot as plt\nfrom ...design import contour",
    "cli": "from .foundation import errors\nfrom .presentation.figures import cam",
    "__main__": "from .cli import main",
    "__init__": "from .model.linear import x\nfrom .foundation import errors",
}


def test_what_is_allowed_passes(tmp_path: Path) -> None:
    package = build(tmp_path, ALLOWED)
    assert list(forbidden(package)) == []
    assert internal_cycles(package) == []


@pytest.mark.parametrize(
    ("module", "text", "complaint"),
    [
        ("components/transmission/cam", "from ...model import flat", "components may not know model"),
        (
            "components/transmission/cam",
            "def f():\n from ...model.flat import x",
            "line 2, imports nlsdesign.model.flat",
        ),
        (
            "components/transmission/cam",
            "if TYPE_CHECKING:\n from ...model import flat",
            "components may not know model",
        ),
        (
            "components/transmission/cam",
            "f = import_module('nlsdesign.model.flat')",
            "components may not know model",
        ),
        (
            "components/transmission/cam",
            "f = importlib.import_module('...model')",
            "components may not know model",
        ),
        (
            "foundation/deck",
            "from ..components.transmission import cam",
            "foundation may not know components",
        ),
        ("foundation/symbolic", "from ..model import flat", "foundation may not know model"),
        (
            "simulation/run",
            "from ..components.transmission.cam import Cam",
            "simulation may not know components",
        ),
        (
            "design/optimisation/solve",
            "from ...components.transmission.cam import Cam",
            "design may not know components",
        ),
        ("design/optimisation/limits", "from ...components import Cam", "design may not know components"),
        (
            "feedback/analysis/sweep",
            "from ...components.assembly.named_parts import Assembly",
            "feedback.analysis may not know components",
        ),
        (
            "design/optimisation/limits",
            "from ...feedback.analysis import sweep",
            "design may not know feedback.analysis",
        ),
        (
            "feedback/analysis/sweep",
            "from ..observer import gains",
            "feedback.analysis may not know feedback.observer",
        ),
        (
            "bench/identification/least_squares",
            "from ..discrepancy import effects",
            "may not know bench.discrepancy",
        ),
        (
            "bench/discrepancy/selection/measures",
            "from ....components.transmission import cam",
            "bench.discrepancy may not know components",
        ),
        (
            "presentation/figures/cam",
            "from ..report import html",
            "presentation.figures may not know presentation.report",
        ),
        ("presentation/report/html", "from ...cli import main", "presentation.report may not know cli"),
        ("model/flat", "import nlsdesign", "no room may import it"),
        ("model/flat", "from .. import __version__", "no room may import it"),
        ("model/flat", "import nlsdesign.model", "no room may import it"),
        ("model/flat", "from ..erors import X", "there is no such module"),
        ("components/core/part", "from ..transmission import cam", "core may not know transmission"),
        ("components/sensing/encoder", "from ..transmission import cam", "sensing may not know transmission"),
        ("components/core/part", "from ... import components", "front of its room"),
        ("bench/discrepancy/tearing", "from .effects import x", "tearing may not know effects"),
        ("components/spring", "", "components.spring is in no inner room"),
        ("helpers", "", "nlsdesign.helpers is in no room of the house"),
        ("presentation/report/html", "import matplotlib.pyplot as plt", "only in presentation.figures"),
        ("feedback/analysis/sweep", "def f():\n    import matplotlib", "only in presentation.figures"),
        ("simulation/run", "import fmpy", "only in export"),
        ("presentation/figures/cam", "import ezdxf", "only in design.drawing"),
        ("model/flat", "import control", "only in model.linear, feedback"),
        ("cli", "import studies.austin2015", "nowhere in the package"),
    ],
)
def test_a_forbidden_import_is_caught(tmp_path: Path, module: str, text: str, complaint: str) -> None:
    rooms = [
        "model/flat",
        "components/transmission/cam",
        "components/assembly/named_parts",
        "feedback/analysis/sweep",
        "feedback/observer/scheduling/gains",
        "bench/discrepancy/effects",
    ]
    empty = dict.fromkeys([*rooms, "cli", "presentation/report/html"], "")
    assert list(forbidden(build(tmp_path / "before", empty))) == []
    found = list(forbidden(build(tmp_path / "after", {**empty, module: text})))
    assert len(found) >= 1
    assert complaint in " ".join(found)


@pytest.mark.parametrize(
    ("files", "cycle"),
    [
        (
            {"components/core/a": "from . import b", "components/core/b": "from . import a"},
            {"components.core.a", "components.core.b"},
        ),
        (
            {
                "model/a": "from . import b",
                "model/b": "from . import c",
                "model/c": "def f():\n from . import a",
            },
            {"model.a", "model.b", "model.c"},
        ),
        # no module is in a circle, but the packages are
        (
            {
                "model/a": "",
                "model/b": "from ..foundation.deck import x",
                "foundation/deck": "from ..model import a",
            },
            {"model", "foundation"},
        ),
        ({"model/a": "from . import value", "model/__init__": "from .a import x"}, {"model", "model.a"}),
    ],
)
def test_a_cycle_is_caught(tmp_path: Path, files: dict[str, str], cycle: set[str]) -> None:
    found = internal_cycles(build(tmp_path, files))
    assert {f"nlsdesign.{name}" for name in cycle} in [set(one.split(" -> ")) for one in found]


def test_an_undeclared_library_is_caught(tmp_path: Path) -> None:
    project = tmp_path / "pyproject.toml"
    project.write_text('[project]\ndependencies = ["NumPy>=2"]\noptional-dependencies = {e = ["zig"]}\n')
    package = build(
        tmp_path, {"deck": "import json, numpy.linalg\nimport torch\nimport zig\ndef f():\n    import zig"}
    )
    found = list(undeclared(package, project))
    assert len(found) == 2
    assert "line 2, imports torch, which pyproject.toml does not declare" in found[0]
    assert "line 3, imports zig, which is optional" in found[1]
