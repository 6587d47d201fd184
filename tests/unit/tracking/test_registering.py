"""Registering: with an earlier champion, beside another process, and under odd names."""

import contextlib
import threading
from concurrent.futures import ThreadPoolExecutor

import mlflow
import pytest
from mlflow.tracking import MlflowClient

from odisar.config.registry import ChampionRule
from odisar.errors import OdisarError
from odisar.tracking import Tracker, registry, tracking_uri
from odisar.tracking.registry import load_model, register
from small_bundle import development_score, write_small_bundle

pytestmark = pytest.mark.slow
RULE = ChampionRule(metric="auroc", margin=0.0)
NAME = "trial.small"


@pytest.fixture
def root(tmp_path, monkeypatch):
    monkeypatch.setenv("MLFLOW_ALLOW_PICKLE_DESERIALIZATION", "false")
    monkeypatch.delenv("ODISAR_TRACKING_ROOT", raising=False)
    uri = mlflow.get_tracking_uri()
    (tmp_path / "src").mkdir()
    set_content(tmp_path, 1)
    yield tmp_path
    mlflow.set_tracking_uri(uri)


@pytest.fixture
def bundle(trained_twin, tmp_path):
    return write_small_bundle(tmp_path / "bundles/small", trained_twin)


@pytest.fixture
def client(root):
    return MlflowClient(tracking_uri(root))


def set_content(root, seed):
    (root / "params.yaml").write_text(f"seed: {seed}\n")


def never(_deployed):
    raise AssertionError("measured again without a reason")


def registered(root, bundle, score=None, rescore=never):
    run = Tracker(root, "trial").parent()
    return register(root, run, bundle, score or development_score(), RULE, rescore)


def test_a_champion_that_scores_other_windows_is_not_compared(root, bundle):
    registered(root, bundle)
    set_content(root, 2)
    elsewhere = development_score(0.5, "c")
    done = registered(root, bundle, development_score(0.95, "b"), lambda _deployed: elsewhere)
    assert not done.is_champion
    assert "it scores other samples (context, horizon or score differ)" in done.decision


def test_two_that_register_one_content_at_once_make_one_version(root, bundle, client, monkeypatch):
    """Both look before either has registered, unless one waits for the other."""
    run = Tracker(root, "trial").parent()
    find, both = registry._find_version, threading.Barrier(2)

    def find_and_wait(*about):
        found = find(*about)
        with contextlib.suppress(threading.BrokenBarrierError):
            both.wait(timeout=3)
        return found

    monkeypatch.setattr(registry, "_find_version", find_and_wait)
    with ThreadPoolExecutor(2) as pool:
        about = (root, run, bundle, development_score(), RULE, never)
        waiting = [pool.submit(register, *about) for _ in range(2)]
        done = [one.result() for one in waiting]
    assert sorted(one.is_new for one in done) == [False, True]
    assert [one.version for one in done] == ["1", "1"]
    assert len(client.search_model_versions(f"name='{NAME}'")) == 1


@pytest.mark.parametrize(
    ("name", "version"),
    [("a'b", "champion"), ("a'b\"c", "1"), ("", "1"), (NAME, "a'b"), (NAME, "9" * 30), (NAME, "²")],
)
def test_an_odd_name_or_version_is_a_sentence_too(root, bundle, name, version):
    registered(root, bundle)
    with pytest.raises(OdisarError, match=f"registered models: {NAME}"):
        load_model(root, name, version)
