"""The Windows library of an FMU runs: on Linux, through a small loader, with the same results."""

from __future__ import annotations

import ctypes
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from nlsdesign.components.assembly.deck_writer import declare
from nlsdesign.export.compilation.cross_compiler import compile_library, host_platform
from nlsdesign.export.fmi.fmu import export_fmu
from nlsdesign.export.fmi.fmu_variables import layout
from nlsdesign.feedback.observer import design_corrected_observer
from nlsdesign.foundation.deck import load_deck
from nlsdesign.model import flatten
from tests.hand_built import observer, plant

LOADER = Path(__file__).with_name("windows_loader.c")
STEP, COUNT = 1e-3, 300


def corrected():
    """An observer whose step has a frame of more than one page, which Windows maps page by page."""
    return design_corrected_observer(flatten(declare(load_deck("austin2015_stiff_spring")))).model


MODELS = {"plant": plant, "observer": observer, "corrected": corrected}


@pytest.mark.long_cases("corrected")
@pytest.mark.parametrize("name", MODELS)
def test_the_windows_library_gives_the_same_as_the_one_for_this_machine(name, tmp_path):
    # The loader, windows_loader.c, puts x86-64 code into a Linux process and calls it there.
    if host_platform() != "x86_64-linux":
        pytest.skip("the loader maps x86-64 code on Linux")
    model, read = MODELS[name](), "spring.torque"
    unit = export_fmu(model, tmp_path / "one.fmu", platforms=["x86_64-linux", "x86_64-windows"])
    references = {v.variable.name: v.reference for v in layout(model).reals}
    written = model.inputs[0].name
    given = 0.6 * np.sin(0.05 * np.arange(COUNT))

    signal = np.array(
        list(zip(STEP * np.arange(COUNT), given, strict=True)), dtype=[("time", float), (written, float)]
    )
    expected = fmpy.simulate_fmu(
        str(unit), stop_time=COUNT * STEP, output_interval=STEP, input=signal, output=[read]
    )[read][1:]

    with zipfile.ZipFile(unit) as archive:
        (dll,) = [n for n in archive.namelist() if n.endswith(".dll")]
        library = archive.read(dll)
    token = fmpy.read_model_description(str(unit)).guid.encode()
    loader = ctypes.CDLL(str(compile_library([LOADER], tmp_path / "loader.so", flags=["-std=gnu99"])))
    found = np.zeros(COUNT)
    pointer = ctypes.POINTER(ctypes.c_double)
    status = loader.run(
        library,
        token,
        references[written],
        np.ascontiguousarray(given).ctypes.data_as(pointer),
        COUNT,
        ctypes.c_double(STEP),
        references[read],
        found.ctypes.data_as(pointer),
    )
    assert status == 0
    assert np.ptp(found) > 0.05
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.ptp(expected))
