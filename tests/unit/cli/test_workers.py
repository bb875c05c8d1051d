"""``--workers`` sets how many processes share the work of a command, whatever the machine has."""

from __future__ import annotations

import os
import time

import click
import pytest
from click.testing import CliRunner

from nlsdesign.cli.main import program
from nlsdesign.cli.options import workers_option
from nlsdesign.foundation.work_sharing import Processes, parallel_map, spread_over
from tests.undrawn import undrawn

__all__ = ["undrawn"]
pytestmark = pytest.mark.usefixtures("undrawn")

linux = pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="processes are forked on Linux only")


def helpers() -> set[int]:
    """Return the processes that eight pieces of work were done in."""

    def piece(number: int) -> int:
        del number
        time.sleep(0.02)  # long enough that no process takes all
        return os.getpid()

    return set(parallel_map(piece, 8))


@linux
@pytest.mark.long_cases("64")
@pytest.mark.parametrize("cores", [1, 64])
def test_work_is_done_in_as_many_processes_as_are_asked_for(
    cores: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)))
    with spread_over(Processes(1)):
        assert helpers() == {os.getpid()}
    with spread_over(Processes(5)):
        assert 1 < len(helpers()) <= 5
        assert os.getpid() not in helpers()
    assert len(helpers()) <= (1 if cores == 1 else 4)


@linux
def test_the_option_holds_for_its_command_alone() -> None:
    @click.command()
    @workers_option
    def shown() -> None:
        click.echo(" ".join(map(str, helpers())))

    done = CliRunner().invoke(shown, ["--workers", "1"])
    assert done.output.split() == [str(os.getpid())]
    assert CliRunner().invoke(shown, ["--workers", "0"]).exit_code == 2


@pytest.mark.parametrize("path", [("design",), ("diagnose",), ("study", "run"), ("sweep",)], ids=" ".join)
def test_commands_with_long_work_have_it(path: tuple[str, ...]) -> None:
    command: click.Command = program
    for name in path:
        assert isinstance(command, click.Group)
        command = command.commands[name]
    assert any("--workers" in each.opts for each in command.params)
