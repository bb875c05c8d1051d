"""Files appear whole or not at all, whoever writes them."""

from __future__ import annotations

from pathlib import Path

import pytest

from nlsdesign.foundation.errors import ExportError
from nlsdesign.foundation.text_files import draft, write_bytes, write_table, write_text


def test_what_was_there_stays_when_writing_fails(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    write_text(file, "old")

    def break_off() -> None:
        with draft(file) as name:
            name.write_text("ne")
            raise ValueError("half way")

    with pytest.raises(ValueError, match="half way"):
        break_off()
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]


def test_a_table_that_breaks_off_leaves_nothing(tmp_path: Path) -> None:
    def rows() -> object:
        yield ["a [m]", "b, c"]
        raise KeyError("unit")

    with pytest.raises(KeyError):
        write_table(tmp_path / "t.csv", rows())  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []
    write_table(tmp_path / "t.csv", [["a [m]", "b, c"], ["1.5", "x"]])
    assert (tmp_path / "t.csv").read_bytes() == b'a [m],"b, c"\r\n1.5,x\r\n'


def test_folders_are_made_and_content_is_what_was_given(tmp_path: Path) -> None:
    write_text(tmp_path / "deep" / "er" / "a.txt", "µ\nω\n")
    assert (tmp_path / "deep" / "er" / "a.txt").read_bytes() == "µ\nω\n".encode()
    write_bytes(tmp_path / "b.bin", b"\x00\r\n")
    assert (tmp_path / "b.bin").read_bytes() == b"\x00\r\n"
    assert (tmp_path / "b.bin").stat().st_mode & 0o777 == 0o644


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    write_text(tmp_path / "file", "in the way")
    with pytest.raises(ExportError, match=r"file/a\.txt.*cannot be written.*another file or folder"):
        write_text(tmp_path / "file" / "a.txt", "x")
    (tmp_path / "folder").mkdir()
    with pytest.raises(ExportError, match=r"folder.*cannot be written"):
        write_text(tmp_path / "folder", "x")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


def test_every_file_of_the_package_is_written_through_here(request: pytest.FixtureRequest) -> None:
    package = request.config.rootpath / "nlsdesign"
    own = [file.name for file in package.rglob("*.py") if "os.replace" in file.read_text(encoding="utf-8")]
    assert sorted(own) == ["text_files.py"]
