"""Downloads are served by a server on this machine: nothing here needs a network."""

import hashlib
import socket
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest

from odisar.config.sources import PinnedFolder
from odisar.errors import OdisarError
from odisar.sources import fetch
from odisar.sources.fetch import fetch_pinned_folder, read_registry

VARIABLE = "ODISAR_TEST_RUNS_FOLDER"
PUBLISHED = {
    "square/1/1_metadata.csv": b"type,omni3\n",
    "square/1/1_run-01.csv": b"0,1,2\n",
    "square/1/1_run-02.csv": b"0,3,4\n",
}
SETTINGS = {
    "url": "https://example.org/pinned/",
    "registry": "runs.sha256",
    "folder": "data/raw/runs",
    "environment_variable": VARIABLE,
    "size_limit_mb": 0.001,
    "timeout_s": 2.0,
    "licence": "MIT",
    "credit": "Some runs",
}


def write_files(folder, files):
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def files_in(folder):
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture(autouse=True)
def _alone(monkeypatch):
    """No local copy, no proxy, and the registry of the files above."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    registry = {name: hashlib.sha256(content).hexdigest() for name, content in PUBLISHED.items()}
    monkeypatch.setattr(fetch, "read_registry", lambda _: registry)


@pytest.fixture
def server(tmp_path):
    """Serve a folder over HTTP; yield it, the pinned folder and the list of paths asked for."""
    served = tmp_path / "served"
    write_files(served, PUBLISHED)
    asked = []

    class Handler(SimpleHTTPRequestHandler):
        def __init__(self, *args):
            super().__init__(*args, directory=str(served))

        def log_message(self, *_):
            asked.append(self.path.removeprefix("/"))

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as running:
        thread = threading.Thread(target=running.serve_forever, args=(0.01,))
        thread.start()
        url = f"http://127.0.0.1:{running.server_port}/"
        # The section refuses what is not https; here nothing leaves the machine.
        pinned = PinnedFolder.model_validate(SETTINGS).model_copy(update={"url": url})
        yield served, pinned, asked
        running.shutdown()
        thread.join()


def test_every_file_is_downloaded_once_and_licence_and_progress_are_told(server, tmp_path):
    _, pinned, asked = server
    said = []
    folder = fetch_pinned_folder(pinned, tmp_path, said.append)
    assert folder == tmp_path / "data" / "raw" / "runs"
    assert {name: (folder / name).read_bytes() for name in files_in(folder)} == PUBLISHED
    assert sorted(asked) == sorted(PUBLISHED)
    assert said == [
        f"downloading 3 of 3 files from {pinned.url} to data/raw/runs",
        "3 files: Some runs; licence MIT. They are not part of this project.",
    ]
    said.clear()
    assert fetch_pinned_folder(pinned, tmp_path, said.append) == folder
    assert len(asked) == 3
    assert len(said) == 1


def test_a_download_that_broke_off_goes_on_where_it_stopped(server, tmp_path):
    served, pinned, asked = server
    last = "square/1/1_run-02.csv"
    (served / last).unlink()
    with pytest.raises(OdisarError, match=r"1_run-02\.csv: cannot be downloaded .* \(HTTPError\)"):
        fetch_pinned_folder(pinned, tmp_path, lambda _: None)
    folder = tmp_path / "data" / "raw" / "runs"
    assert files_in(folder) == {*PUBLISHED} - {last}
    write_files(served, PUBLISHED)
    asked.clear()
    said = []
    fetch_pinned_folder(pinned, tmp_path, said.append)
    assert asked == [last]
    assert said[0].startswith("downloading 1 of 3 files")
    assert files_in(folder) == {*PUBLISHED}


def test_a_file_that_was_damaged_after_its_download_is_replaced(server, tmp_path):
    _, pinned, asked = server
    folder = fetch_pinned_folder(pinned, tmp_path, lambda _: None)
    name = "square/1/1_run-01.csv"
    (folder / name).write_bytes(b"cut off")
    asked.clear()
    fetch_pinned_folder(pinned, tmp_path, lambda _: None)
    assert asked == [name]
    assert (folder / name).read_bytes() == PUBLISHED[name]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"changed", r"1_run-01\.csv from .*: expected SHA-256 [0-9a-f]{64}, found d67e2e944994"),
        (bytes(1001), r"1_run-01\.csv: larger than size_limit_mb=0\.001"),
    ],
)
def test_a_file_that_is_not_the_published_one_is_not_kept(server, tmp_path, content, message):
    served, pinned, _ = server
    name = "square/1/1_run-01.csv"
    (served / name).write_bytes(content)
    with pytest.raises(OdisarError, match=message) as caught:
        fetch_pinned_folder(pinned, tmp_path, lambda _: None)
    assert VARIABLE in str(caught.value)
    assert files_in(tmp_path / "data" / "raw" / "runs") == {"square/1/1_metadata.csv"}


def test_without_a_network_one_sentence_names_the_variable(tmp_path):
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}/"
        pinned = PinnedFolder.model_validate(SETTINGS).model_copy(update={"url": url})
        with pytest.raises(OdisarError) as caught:
            fetch_pinned_folder(pinned, tmp_path, lambda _: None)
    message = str(caught.value)
    assert message.startswith(f"{url}square/1/1_metadata.csv: cannot be downloaded")
    assert f"set {VARIABLE} to a local copy of the files" in message
    assert "\n" not in message


def test_a_local_copy_goes_before_a_download(server, tmp_path, monkeypatch):
    _, pinned, asked = server
    copy = tmp_path / "copy"
    write_files(copy, PUBLISHED)
    monkeypatch.setenv(VARIABLE, str(copy))
    said = []
    assert fetch_pinned_folder(pinned, tmp_path, said.append) == copy
    assert asked == []
    assert len(said) == 1
    assert "MIT" in said[0]


def test_a_local_copy_names_what_is_missing_and_what_differs(tmp_path, monkeypatch):
    copy = tmp_path / "copy"
    write_files(copy, PUBLISHED | {"square/1/1_run-01.csv": b"changed"})
    (copy / "square/1/1_run-02.csv").unlink()
    monkeypatch.setenv(VARIABLE, str(copy))
    with pytest.raises(OdisarError) as caught:
        fetch_pinned_folder(PinnedFolder.model_validate(SETTINGS), tmp_path, lambda _: None)
    assert str(caught.value) == (
        f"{VARIABLE}={copy}: 1 of 3 files are missing (square/1/1_run-02.csv) and 1 of 3 files "
        "have another SHA-256 than the published ones (square/1/1_run-01.csv); set "
        f"{VARIABLE} to an unchanged copy of https://example.org/pinned/ or unset it to download "
        "the files"
    )


def test_a_local_copy_that_is_no_folder_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "absent"))
    with pytest.raises(OdisarError, match="there is no such folder"):
        fetch_pinned_folder(PinnedFolder.model_validate(SETTINGS), tmp_path, lambda _: None)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("url", "http://example.org/pinned/"),
        ("url", "https://example.org/pinned"),
        ("registry", "../runs.sha256"),
    ],
)
def test_a_folder_that_is_not_pinned_safely_is_no_configuration(key, value):
    with pytest.raises(ValueError, match=key):
        PinnedFolder.model_validate(SETTINGS | {key: value})


def test_the_registry_of_the_robot_s_runs_has_a_sum_for_every_file():
    pinned = PinnedFolder.model_validate(SETTINGS | {"registry": "omni3.sha256"})
    registry = read_registry(pinned)
    runs = [name for name in registry if "_run-" in name]
    assert (len(registry), len(runs)) == (92, 80)
    sessions = {name.rsplit("/", 1)[0] for name in registry}
    assert {f"{s}/{s.rsplit('/')[-1]}_metadata.csv" for s in sessions} == {*registry} - {*runs}
    assert all(len(sum_) == 64 and int(sum_, 16) >= 0 for sum_ in registry.values())
