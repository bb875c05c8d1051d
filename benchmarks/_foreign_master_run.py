"""One FMU in one foreign master; run as a script in the environment of the masters, without nlsdesign.

python _foreign_master_run.py MASTER FMU INPUTS.csv RESULTS.csv NAME...

Inputs are set at each communication point and held; results are read after each step.
"""

from __future__ import annotations

import csv
import ctypes
import importlib.metadata
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

Row = Sequence[float]


class Described:
    """What a master that leaves the model description to its user has to know of it."""

    def __init__(self, path: str) -> None:
        self.path = path
        with zipfile.ZipFile(path) as archive:
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))
        self.two = root.get("fmiVersion") == "2.0"
        self.token = root.get("guid") or root.get("instantiationToken") or ""
        kind = root.find("CoSimulation")
        self.identifier = "" if kind is None else kind.get("modelIdentifier", "")
        variables = root.find("ModelVariables")
        every = [] if variables is None else list(variables)
        self.references = {v.get("name", ""): int(v.get("valueReference", "0")) for v in every}
        self.outputs = {v.get("name", "") for v in every if v.get("causality") == "output"}


def fmpy(fmu: Described, time: Row, inputs: Mapping[str, Row], names: Sequence[str]) -> Iterator[Row]:
    import numpy as np
    from fmpy import simulate_fmu

    rows = list(zip(time, *inputs.values(), strict=True))
    signals = np.array(rows, dtype=[(name, float) for name in ("time", *inputs)])
    result = simulate_fmu(
        fmu.path,
        stop_time=time[-1],
        step_size=time[1],
        output_interval=time[1],
        input=signals,
        output=list(names),
        fmi_type="CoSimulation",
    )
    for row in result[1:]:
        yield [float(row[name]) for name in names]


def ecospy(fmu: Described, time: Row, inputs: Mapping[str, Row], names: Sequence[str]) -> Iterator[Row]:
    # Its library is linked to that of the wheel tbb, which stands where no loader looks.
    ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), mode=ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation, EcosSimulationStructure

    with EcosSimulationStructure() as structure:
        structure.add_model("unit", fmu.path)
        with EcosSimulation(step_size=time[1], structure=structure) as simulation:
            simulation.init()
            for k in range(len(time) - 1):
                for name, values in inputs.items():
                    simulation.set_real(f"unit::{name}", values[k])
                simulation.step(1)
                yield [simulation.get_real(f"unit::{name}") for name in names]
            simulation.terminate()


def libcosimpy(fmu: Described, time: Row, inputs: Mapping[str, Row], names: Sequence[str]) -> Iterator[Row]:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(round(1e9 * time[1]))
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=fmu.path, instance_name="unit"))
    given, seen = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(given)
    execution.add_observer(seen)
    into, out = [fmu.references[n] for n in inputs], [fmu.references[n] for n in names]
    for k in range(len(time) - 1):
        given.slave_real_values(slave, into, [values[k] for values in inputs.values()])
        if not execution.step():
            raise RuntimeError(f"step {k} failed")
        yield list(seen.last_real_values(slave, out))


def fmuloader(fmu: Described, time: Row, inputs: Mapping[str, Row], names: Sequence[str]) -> Iterator[Row]:
    unit: Any
    if fmu.two:
        from fmuloader.fmi2 import Fmi2Slave, Fmi2Type

        unit = Fmi2Slave(fmu.path, model_identifier=fmu.identifier)
        unit.instantiate("unit", Fmi2Type.CO_SIMULATION, guid=fmu.token)
        unit.setup_experiment(start_time=0.0)
        unit.enter_initialization_mode()
        put, get = unit.set_real, unit.get_real
    else:
        from fmuloader.fmi3 import Fmi3Slave

        unit = Fmi3Slave(fmu.path, model_identifier=fmu.identifier)
        unit.instantiate_co_simulation("unit", instantiation_token=fmu.token)
        unit.enter_initialization_mode(start_time=0.0)
        put, get = unit.set_float64, unit.get_float64
    unit.exit_initialization_mode()
    into, out = [fmu.references[n] for n in inputs], [fmu.references[n] for n in names]
    for k in range(len(time) - 1):
        put(into, [values[k] for values in inputs.values()])
        unit.do_step(time[k], time[k + 1] - time[k])
        yield get(out)
    unit.terminate()
    unit.free_instance()


def cofmupy(fmu: Described, time: Row, inputs: Mapping[str, Row], names: Sequence[str]) -> Iterator[Row]:
    from cofmupy.master.default_master import DefaultMaster

    unit = {"id": "unit", "path": fmu.path, "name": "unit", "initialization": {}}
    master = DefaultMaster([unit], {}, [["unit"]])
    master.init_simulation()
    for k in range(len(time) - 1):
        given = {"unit": {name: [values[k]] for name, values in inputs.items()}}
        shown = master.do_step(time[1], input_dict=given)["unit"]
        yield [float(shown[name][0]) if name in fmu.outputs else float("nan") for name in names]


def casadi(fmu: Described, time: Row, inputs: Mapping[str, Row], names: Sequence[str]) -> Iterator[Row]:
    """Integrate the states of a model-exchange FMU with the derivatives that it offers."""
    import casadi as ca

    folder = tempfile.mkdtemp()
    with zipfile.ZipFile(fmu.path) as archive:
        archive.extractall(folder)
    model = ca.DaeBuilder("unit", folder)
    rate = model.create("rate", ["x", "u"], ["ode"])
    states = model.x()
    x, u = ca.MX.sym("x", len(states)), ca.MX.sym("u", len(model.u()))
    tight = {"abstol": 1e-12, "reltol": 1e-10, "max_num_steps": 100000}
    step = ca.integrator("step", "cvodes", {"x": x, "u": u, "ode": rate(x, u)}, 0.0, time[1], tight)
    at = [float(model.start(name)[0]) for name in states]
    for k in range(len(time) - 1):
        at = step(x0=at, u=[inputs[name][k] for name in model.u()])["xf"]
        shown = dict(zip(states, at.full().ravel().tolist(), strict=True))
        yield [shown.get(name, float("nan")) for name in names]


MASTERS: Mapping[str, Callable[..., Iterator[Row]]] = {
    each.__name__: each for each in (fmpy, ecospy, libcosimpy, fmuloader, cofmupy, casadi)
}


def main() -> None:
    """Run one master and write what it shows."""
    master, fmu, given, results, *names = sys.argv[1:]
    with open(given, encoding="utf-8", newline="") as stream:
        head, *rows = list(csv.reader(stream))
    columns = {name: [float(row[i]) for row in rows] for i, name in enumerate(head)}
    time = columns.pop("time")
    shown = list(MASTERS[master](Described(fmu), time, columns, names))
    with open(results, "w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(names)
        writer.writerows([[repr(float(x)) for x in row] for row in shown])
    print(importlib.metadata.version(master))


if __name__ == "__main__":
    main()
