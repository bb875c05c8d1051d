"""A step as a library: CMake builds and finds it, PlatformIO's schema, Arduino and ros2_control take it."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

import nlsdesign as nls
from nlsdesign.export import CSource, export_c, write_package
from nlsdesign.export.compilation.compiled_step import CompiledStep
from nlsdesign.feedback.control import joined

ARDUINO = """
#pragma once
#include <stdint.h>
static inline uint32_t micros() { static uint32_t now = 0u; now += 1000u; return now; }
"""
MAIN = """#include "step.h"
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
    assert "-lm" in manifest["build"]["flags"]  # the platform "native" links without libm by itself
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


HEADERS = Path(__file__).parents[2] / "ros2_headers"
PLUGINLIB = """
#pragma once
#include <type_traits>
#define PLUGINLIB_EXPORT_CLASS(A, B) \\
    static_assert(std::is_base_of<B, A>::value && !std::is_abstract<A>::value, "");
"""
CONTROLLER_MANAGER = r"""
#include <cstdio>
#include "loop_transmission_loader.cpp"
int main(int count, char **)
{
    hardware_interface::TransmissionInfo info;
    hardware_interface::JointInfo joint;
    joint.mechanical_reduction = 4.0;
    joint.offset = 0.25;
    info.joints.push_back(joint);
    info.parameters["effort_per_command"] = "0.5";
    loop_ros2::Loader loader;
    std::shared_ptr<transmission_interface::Transmission> base = loader.load(info);
    double position = 0, velocity = 0, effort = 0, encoder = 0, command = 0, wished = 0;
    std::vector<transmission_interface::JointHandle> joints = {
        {"knee", "position", &position}, {"knee", "velocity", &velocity}, {"knee", "effort", &effort}};
    std::vector<transmission_interface::ActuatorHandle> actuators = {
        {"motor", "position", &encoder}, {"motor", "effort", &command}};
    if (count > 1) { joints.pop_back(); }
    try {
        base->configure(joints, actuators);
    } catch (const std::exception &error) {
        std::puts(error.what());
        return 3;
    }
    while (std::scanf("%lf %lf", &encoder, &wished) == 2) {
        base->actuator_to_joint();
        std::printf("%a %a %a ", position, velocity, effort);
        effort = wished;
        base->joint_to_actuator();
        std::printf("%a %u\n", command, static_cast<loop_ros2::ElasticTransmission &>(*base).status());
    }
    return 0;
}
"""


# As installed packages are found: targets alone, for the macro that took names of packages is gone in newer
# releases of ROS.
CONFIG = """
add_library(@name@::@name@ INTERFACE IMPORTED)
set_target_properties(@name@::@name@ PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "@headers@;@stubs@")
"""
AMENT = """
function(pluginlib_export_plugin_description_file)
endfunction()
function(ament_package)
endfunction()
"""


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> tuple[CSource, Path]:
    folder = tmp_path_factory.mktemp("loop")
    plant = nls.flatten(nls.declare(nls.load_deck("austin2015_figure_consistent")))
    observer = nls.design_observer(plant, gain=nls.observer.CascadeGain())
    source = export_c(joined(observer, nls.torque_controller(plant)), folder / "c", name="loop")
    write_package(source, folder / "library")
    (folder / "pluginlib").mkdir()
    (folder / "pluginlib" / "class_list_macros.hpp").write_text(PLUGINLIB)
    return source, folder / "library"


def test_a_step_divides_by_no_constant_and_asks_nothing_twice(loop: tuple[CSource, Path]) -> None:
    """Sixteen divisions by constants, 14 cycles each, and one range asked for twice were counted once."""
    text = loop[0].source.read_text(encoding="utf-8")
    assert re.findall(r"/ \(?[0-9][0-9.e+-]*f?\b", re.sub(r"/\*.*?\*/", "", text, flags=re.S)) == []
    asked = re.findall(r"\(([^()]*\|\|[^()]*)\)", text)
    assert asked
    for question in asked:
        clauses = [clause.strip() for clause in question.split("||")]
        assert len(set(clauses)) == len(clauses)


@pytest.mark.skipif(
    shutil.which("cmake") is None or shutil.which("g++") is None, reason="no cmake, or no g++"
)
@pytest.mark.slow
def test_the_package_of_ros2_control_builds_with_targets_of_installed_packages(
    loop: tuple[CSource, Path], tmp_path: Path
) -> None:
    _, library = loop
    for name in ("ament_cmake", "hardware_interface", "pluginlib", "transmission_interface"):
        text = AMENT if name == "ament_cmake" else CONFIG.replace("@name@", name)
        text = text.replace("@headers@", str(HEADERS)).replace("@stubs@", str(library.parent))
        (tmp_path / f"{name}-config.cmake").write_text(text)
    ran("cmake", "-S", library / "ros2_control", "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={tmp_path}",
        *(f"-D{name}_DIR={tmp_path}" for name in ("ament_cmake", "hardware_interface", "pluginlib",
                                                   "transmission_interface")))  # fmt: skip
    ran("cmake", "--build", tmp_path / "build")
    assert list((tmp_path / "build").glob("libloop_ros2.*"))


@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++")
def test_ros2_control_loads_the_loop_as_a_transmission_and_gets_the_numbers_of_the_step(
    loop: tuple[CSource, Path], tmp_path: Path
) -> None:
    source, library = loop
    ros = library / "ros2_control"
    (tmp_path / "main.cpp").write_text(CONTROLLER_MANAGER)
    ran("gcc", "-std=c99", "-O2", "-ffp-contract=off", "-c", source.source, "-o", tmp_path / "loop.o")
    includes = [f"-I{folder}" for folder in (library.parent, ros, library / "src", HEADERS)]
    ran("g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", *includes, tmp_path / "main.cpp",
        tmp_path / "loop.o", "-lm", "-o", tmp_path / "main")  # fmt: skip
    given = [(4.0 * (0.4 * math.sin(0.02 * k) - 0.25), math.sin(0.03 * k)) for k in range(200)]
    given[120] = (math.nan, 0.5)
    words = "\n".join(f"{encoder!r} {wished!r}" for encoder, wished in given)
    done = subprocess.run([tmp_path / "main"], input=words, capture_output=True, text=True, check=True)
    rows = [line.split() for line in done.stdout.splitlines()]
    assert len(rows) == len(given)
    step, names = CompiledStep(source), [v.name for v in source.model.outputs]
    last = dict.fromkeys(names, 0.0)
    for (encoder, wished), row in zip(given, rows, strict=True):
        position, velocity, effort, command = (float.fromhex(number) for number in row[:4])
        angle = encoder / 4.0 + 0.25
        assert position == angle or math.isnan(angle)
        assert (velocity, effort) == (last["motor.speed"], last["spring.torque"])
        outputs, status = step([angle, wished])
        last = dict(zip(names, outputs, strict=True))
        assert (command, int(row[4])) == (0.5 * last["motor.current"], status)
    assert abs(last["spring.torque"]) > 0.1
    refused = subprocess.run([tmp_path / "main", "less"], capture_output=True, text=True, check=False)
    assert refused.returncode == 3
    assert "loop: needs effort of the joint, position and effort of the actuator" in refused.stdout
    plugins = ElementTree.parse(ros / "ros2_control_plugins.xml").getroot()
    (named,) = plugins.iter("class")
    assert named.get("base_class_type") == "transmission_interface::TransmissionLoader"
    assert (
        ElementTree.parse(ros / "package.xml").getroot().findtext("name")
        == plugins.get("path")
        == "loop_ros2"
    )


def test_a_controller_alone_is_no_transmission(package: Path) -> None:
    assert not (package / "ros2_control").exists()
