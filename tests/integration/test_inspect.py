"""What is wrong with a stranger's recordings is said without a profile being proposed."""

import re

import pytest

from .strangers import run, write_rovers

pytestmark = pytest.mark.usefixtures("root")


def test_inspect_finds_the_profile_by_its_folder_and_names_every_error(folder, capsys):
    write_rovers(folder, files=4)
    assert run("new-case", folder, "--name", "rover", "--write") == 0
    capsys.readouterr()
    assert run("inspect", folder) == 0
    text = capsys.readouterr().out
    assert "read as profile rover says" in text
    assert "4 of 4 recordings can be used" in text
    assert re.search(r"v \[m/s\] +m/s +forecast", text)
    lines = (folder / "Fahrt 1.csv").read_text().splitlines(keepends=True)
    lines[6] = lines[6].replace(lines[6].split(";")[3], "")
    (folder / "Fahrt 1.csv").write_text("".join(lines))
    (folder / "Fahrt 2.csv").write_bytes(b"")
    (folder / "lost.csv").symlink_to("/nowhere")
    (folder / "folder.csv").mkdir()
    assert run("inspect", folder, "--profile", "rover") == 1
    text = capsys.readouterr().out
    assert re.search(r"error +Fahrt 1\.csv +7 +v \[m/s\] +the value is missing", text)
    assert re.search(r"error +Fahrt 2\.csv +the file is empty", text)
    assert "a folder has the name" in text
    assert "2 of 6 recordings can be used" in text
    assert max(map(len, text.splitlines())) <= 120


def test_inspect_without_a_case_takes_what_would_be_proposed(folder, capsys):
    write_rovers(folder, files=4)
    assert run("inspect", folder) == 0
    assert "`odisar new-case` would propose" in capsys.readouterr().out


def test_inspect_as_a_case_that_does_not_fit_says_what_is_missing(folder, capsys):
    write_rovers(folder, files=1)
    assert run("inspect", folder, "--case", "gunnerus") == 1
    assert "the column is missing" in capsys.readouterr().out
    assert run("inspect", folder, "--case", "mine") == 1
    assert "case 'mine' is not declared" in capsys.readouterr().err
