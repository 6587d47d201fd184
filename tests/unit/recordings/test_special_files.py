"""Pipes and devices where files are expected: reading one would not end."""

import os
from pathlib import Path

import pytest

DEVICE = Path("/dev/zero")


@pytest.fixture(params=["pipe", "device"])
def place(request):
    """Put a pipe, or a link to a device, where a path says."""

    def put(path):
        path.unlink(missing_ok=True)
        if request.param == "pipe":
            os.mkfifo(path)
        else:
            path.symlink_to(DEVICE)

    return put


@pytest.mark.parametrize(
    "name", ["a.csv", "a.parquet", "a.mcap", "a.db3", "recordings.csv", "labels.csv"]
)
def test_a_file_that_is_none_is_refused(bag_boat, place, name):
    bag_boat.good("b.csv")
    place(bag_boat.folder / name)
    finding = bag_boat.one("not a regular file")
    assert (finding.severity, finding.file, finding.value) == ("error", f"boat/{name}", name)


@pytest.mark.parametrize("name", ["metadata.yaml", "a.mcap", "b.db3", "listed under another name"])
def test_a_bag_with_a_file_that_is_none_is_refused(bag_boat, ros, messages, place, name):
    path = ros.write(bag_boat.folder / "a", messages)
    place(path / name)
    finding = bag_boat.one("not a regular file")
    assert (finding.severity, finding.file, finding.value) == ("error", "boat/a", name)


def test_a_link_to_a_file_is_read(boat, tmp_path):
    boat.good("a.csv").rename(tmp_path / "elsewhere")
    (boat.folder / "a.csv").symlink_to(tmp_path / "elsewhere")
    assert boat.read().findings == []
