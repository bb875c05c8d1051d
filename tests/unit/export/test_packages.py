"""A step as a library: CMake builds and finds it, the schema of PlatformIO and a C++ compiler take it."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

import nlsdesign as nls
from nlsdesign.export import export_c, write_package

ARDUINO = """
#pragma once
#include <stdint.h>
static inline uint32_t micros() { static uint32_t now = 0u; now += 1000u; return now; }
"""
MAIN = """#include <stddef.h>
#include "step.h"
int main(void) { static step_state s; return (int)step_init(&s, NULL); }
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    plant = nls.flatten(nls.declare(nls.load_deck("test_rig")))
    source = export_c(nls.torque_controller(plant), tmp_path_factory.mktemp("c"), real="float", name="step")
    folder = tmp_path_factory.mktemp("library")
    written = write_package(source, folder)
    assert all(file.is_file() for file in written)
    return folder


def ran(*words: str | Path) -> str:
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.skipif(shutil.which("cmake") is None or shutil.which("cc") is None, reason="no cmake, or no cc")
def test_cmake_builds_tests_installs_and_finds_it(package: Path, tmp_path: Path) -> None:
    ran("cmake", "-S", package, "-B", tmp_path / "build", f"-DCMAKE_INSTALL_PREFIX={tmp_path / 'installed'}")
    ran("cmake", "--build", tmp_path / "build")
    assert "100% tests passed" in ran("ctest", "--test-dir", tmp_path / "build")
    ran("cmake", "--install", tmp_path / "build")
    user = tmp_path / "user"
    user.mkdir()
    (user / "main.c").write_text(MAIN)
    (user / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(user C)\nfind_package(step REQUIRED)\n"
        "add_executable(user main.c)\ntarget_link_libraries(user PRIVATE step::step)\n"
    )
    ran("cmake", "-S", user, "-B", user / "build", f"-DCMAKE_PREFIX_PATH={tmp_path / 'installed'}")
    ran("cmake", "--build", user / "build")
    ran(user / "build" / "user")


def test_the_manifest_of_platformio_has_what_its_schema_asks_for(package: Path) -> None:
    manifest = json.loads((package / "library.json").read_text(encoding="utf-8"))
    assert (manifest["name"], manifest["headers"]) == ("step", "step.h")
    assert (package / manifest["build"]["srcDir"] / "step.c").is_file()
    assert all((package / each["base"] / each["files"][0]).is_file() for each in manifest["examples"])
    parser = pytest.importorskip("platformio.package.manifest.parser")
    schema = pytest.importorskip("platformio.package.manifest.schema").ManifestSchema()
    read = parser.ManifestParserFactory.new_from_dir(str(package)).as_dict()
    assert schema.load_manifest(read)["name"] == "step"


def test_the_properties_of_arduino_are_complete_and_the_sketch_compiles(
    package: Path, tmp_path: Path
) -> None:
    lines = (package / "library.properties").read_text(encoding="utf-8").splitlines()
    fields = dict(line.split("=", 1) for line in lines)
    # As the specification of Arduino libraries (1.6.x) asks for.
    wanted = {
        "name",
        "version",
        "author",
        "maintainer",
        "sentence",
        "paragraph",
        "category",
        "url",
        "architectures",
    }
    assert wanted <= set(fields)
    assert fields["category"] == "Device Control"
    if shutil.which("g++") is None:
        pytest.skip("no g++")
    sketch = (package / "examples" / "step_loop" / "step_loop.ino").read_text(encoding="utf-8")
    (tmp_path / "Arduino.h").write_text(ARDUINO)
    text = f'#include "Arduino.h"\n{sketch}\nint main() {{ setup(); loop(); return 0; }}\n'
    (tmp_path / "sketch.cpp").write_text(text)
    ran(
        "gcc",
        "-std=c99",
        "-Wall",
        "-Werror",
        "-ffp-contract=off",
        "-c",
        package / "src" / "step.c",
        "-o",
        tmp_path / "step.o",
    )
    includes = (f"-I{tmp_path}", f"-I{package / 'src'}")
    files = (tmp_path / "sketch.cpp", tmp_path / "step.o", "-lm", "-o", tmp_path / "sketch")
    ran("g++", "-Wall", "-Werror", *includes, *files)
    ran(tmp_path / "sketch")


def test_zephyr_finds_its_files_and_its_switch(package: Path) -> None:
    module = (package / "zephyr" / "module.yml").read_text(encoding="utf-8")
    assert module.splitlines() == ["name: step", "build:", "  cmake: zephyr", "  kconfig: zephyr/Kconfig"]
    text = (package / "zephyr" / "CMakeLists.txt").read_text(encoding="utf-8")
    assert "if(CONFIG_STEP)" in text
    assert "config STEP\n" in (package / "zephyr" / "Kconfig").read_text(encoding="utf-8")
    assert "../src/step.c" in text
