import pytest
import requests

from odisar.config.sources import PinnedFile
from odisar.errors import OdisarError
from odisar.sources.fetch import fetch_pinned

PUBLISHED = b"tvec,Azi\n0.0,1.0\n"
VARIABLE = "ODISAR_TEST_TRIAL_CSV"


class Response:
    headers = {}  # noqa: RUF012 -- read only

    def __init__(self, body):
        self._body = body

    def raise_for_status(self):
        pass

    def iter_content(self, chunk_size):
        for start in range(0, len(self._body), chunk_size):
            yield self._body[start : start + chunk_size]


@pytest.fixture(autouse=True)
def _no_local_copy(monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)


@pytest.fixture
def serve(monkeypatch):
    """Answer every request with a body, or raise what is given; return the addresses asked."""
    asked = []

    def start(answer):
        def get(url, **_):
            asked.append(url)
            if isinstance(answer, Exception):
                raise answer
            return Response(answer)

        monkeypatch.setattr(requests, "get", get)
        return asked

    return start


def files_in(folder):
    return [path.name for path in folder.rglob("*") if path.is_file()]


def test_downloads_once_and_tells_the_licence_each_time(config, tmp_path, serve):
    asked = serve(PUBLISHED)
    said = []
    first = fetch_pinned(config.file, tmp_path, said.append)
    second = fetch_pinned(config.file, tmp_path, said.append)
    assert first == second == tmp_path / "data" / "raw" / "trial.csv"
    assert first.read_bytes() == PUBLISHED
    assert asked == [config.file.url]
    assert len(said) == 2
    assert all("GPL-3" in sentence for sentence in said)


def test_a_damaged_earlier_download_is_replaced(config, tmp_path, serve):
    serve(PUBLISHED)
    path = tmp_path / "data" / "raw" / "trial.csv"
    path.parent.mkdir(parents=True)
    path.write_bytes(b"cut off")
    fetch_pinned(config.file, tmp_path, lambda _: None)
    assert path.read_bytes() == PUBLISHED


def test_a_local_copy_goes_before_a_download(config, tmp_path, serve, monkeypatch):
    asked = serve(PUBLISHED)
    copy = tmp_path / "copy.csv"
    copy.write_bytes(PUBLISHED)
    monkeypatch.setenv(VARIABLE, str(copy))
    assert fetch_pinned(config.file, tmp_path, lambda _: None) == copy
    assert asked == []


def test_a_changed_local_copy_is_refused_with_both_sums(config, tmp_path, monkeypatch):
    copy = tmp_path / "copy.csv"
    copy.write_bytes(b"changed")
    monkeypatch.setenv(VARIABLE, str(copy))
    with pytest.raises(OdisarError) as caught:
        fetch_pinned(config.file, tmp_path, lambda _: None)
    # sha256("changed"), from sha256sum.
    found = "d67e2e944994496c8d8ec76eed0cf9f09679448d584b532bebf941852a37f5ed"
    message = str(caught.value)
    assert str(copy) in message
    assert f"expected SHA-256 {config.file.sha256}, found {found}" in message
    assert f"set {VARIABLE}" in message


def test_a_local_copy_that_is_not_there_is_refused(config, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "absent.csv"))
    with pytest.raises(OdisarError, match="there is no such file"):
        fetch_pinned(config.file, tmp_path, lambda _: None)


def test_a_changed_download_is_refused_and_not_kept(config, tmp_path, serve):
    serve(b"changed")
    with pytest.raises(OdisarError) as caught:
        fetch_pinned(config.file, tmp_path, lambda _: None)
    message = str(caught.value)
    assert "trial.csv" in message
    assert f"expected SHA-256 {config.file.sha256}, found " in message
    assert VARIABLE in message
    assert files_in(tmp_path) == []


def test_a_download_beyond_the_size_limit_is_stopped(config, tmp_path, serve):
    serve(bytes(1_000_001))
    with pytest.raises(OdisarError, match=r"larger than size_limit_mb=1\.0"):
        fetch_pinned(config.file, tmp_path, lambda _: None)
    assert files_in(tmp_path) == []


@pytest.mark.parametrize(
    "fault", [requests.ConnectionError("no route\nto host"), requests.Timeout(), OSError("disk")]
)
def test_without_a_network_one_sentence_names_the_variable(config, tmp_path, serve, fault):
    serve(fault)
    with pytest.raises(OdisarError) as caught:
        fetch_pinned(config.file, tmp_path, lambda _: None)
    message = str(caught.value)
    assert message.startswith(f"{config.file.url}: cannot be downloaded")
    assert f"set {VARIABLE} to a local copy" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("key", "value"),
    [("url", "http://example.org/trial.csv"), ("sha256", "abc"), ("file_name", "../trial.csv")],
)
def test_a_file_that_is_not_pinned_safely_is_no_configuration(settings, key, value):
    with pytest.raises(ValueError, match=key):
        PinnedFile.model_validate(settings["file"] | {key: value})
