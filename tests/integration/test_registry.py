"""A bundle in the MLflow registry: registered once, loaded without pickle, checked, promoted."""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

import mlflow
import pandas as pd
import pytest
from mlflow.tracking import MlflowClient

from odisar.cli import main
from odisar.config.registry import ChampionRule
from odisar.deployment.bundle import read_bundle
from odisar.deployment.manifest import manifest_hash
from odisar.errors import OdisarError
from odisar.tracking import Tracker, content_key, tracking_uri
from odisar.tracking.registry import load_model, register
from small_bundle import (
    development_score,
    expected,
    pushed,
    table_of,
    write_small_bundle,
)

pytestmark = pytest.mark.slow
RULE = ChampionRule(metric="auroc", margin=0.0)
NAME = "trial.small"


@pytest.fixture(autouse=True)
def _without_pickle(monkeypatch):
    monkeypatch.setenv("MLFLOW_ALLOW_PICKLE_DESERIALIZATION", "false")
    monkeypatch.delenv("ODISAR_TRACKING_ROOT", raising=False)
    uri = mlflow.get_tracking_uri()
    yield
    mlflow.set_tracking_uri(uri)


@pytest.fixture
def root(tmp_path):
    (tmp_path / "src").mkdir()
    set_content(tmp_path, 1)
    return tmp_path


def set_content(root: Path, seed: int) -> None:
    (root / "params.yaml").write_text(f"seed: {seed}\n")


def never(_deployed):
    raise AssertionError("measured again without a reason")


def of_other_channels(_deployed):
    raise OdisarError("its channels are others")


def registered(root, bundle, score=None, rescore=never):
    run = Tracker(root, "trial").parent()
    return register(root, run, bundle, score or development_score(), RULE, rescore)


@pytest.fixture
def bundle(trained_twin, tmp_path):
    return write_small_bundle(tmp_path / "bundles/small", trained_twin)


@pytest.fixture
def client(root):
    return MlflowClient(tracking_uri(root))


def stored(client, version=1) -> Path:
    """Return the folder in which the store keeps a version's files."""
    source = client.get_model_version(NAME, str(version)).source
    location = client.get_logged_model(source.removeprefix("models:/")).artifact_location
    return Path(location.removeprefix("file://"))


def test_a_model_loaded_by_alias_says_exactly_what_the_pipeline_says(root, bundle, trained_twin):
    done = registered(root, bundle)
    assert (done.model, done.version, done.is_champion, done.is_new) == (NAME, "1", True, True)
    assert "version 1@champion: version 1 is the first" in done.line
    model = load_model(root, NAME, "champion")
    recording = pushed()
    said = model.predict(table_of(recording, named=True)).to_dict("records")
    assert said == [asdict(assessment) for assessment in expected(trained_twin, recording)]


def test_the_version_says_what_it_is_and_what_was_measured(root, bundle, client):
    registered(root, bundle)
    version = client.get_model_version(NAME, "1")
    assert version.tags["odisar.content"] == content_key(root)
    assert version.tags["odisar.manifest_sha256"] == manifest_hash(bundle)
    assert version.tags["odisar.setup"] == "small"
    assert version.tags["odisar.development.auroc"] == "0.9"
    assert {"git.revision", "data.hash", "odisar.case"} <= set(version.tags)
    for part in ("# A small system", "load_model(", "0.2", "AUROC 0.900 [0.850, 0.950]", "Speed"):
        assert part in version.description
    assert version.tags["odisar.decision"] in version.description
    info = mlflow.models.get_model_info(f"models:/{NAME}/1")
    assert "state_attribution" in info.signature.outputs.input_names()
    names = [column["name"] for column in info.metadata["odisar.inputs"]]
    assert names == ["time_s", "Command", "Speed", "Turn Rate", "recording"]


def test_nothing_in_a_model_is_pickled_and_requirements_are_pinned(root, bundle, client):
    registered(root, bundle)
    folder = stored(client)
    kinds = {path.suffix for path in folder.rglob("*") if path.is_file()}
    assert not kinds & {".pkl", ".pickle", ".pt", ".pth", ".joblib", ".cloudpickle", ".pyc"}
    lines = (folder / "requirements.txt").read_text().split()
    assert all("==" in line and "+" not in line for line in lines)
    assert {"torch", "mlflow", "pandas"} <= {line.partition("==")[0] for line in lines}


def test_a_second_time_registers_nothing_new(root, bundle, client):
    registered(root, bundle)
    again = registered(root, bundle, development_score(0.99))
    assert (again.version, again.is_new, again.is_champion) == ("1", False, True)
    assert len(client.search_model_versions(f"name='{NAME}'")) == 1


def test_a_registration_cut_off_before_its_decision_is_completed(root, bundle, client):
    registered(root, bundle)
    client.delete_model_version_tag(NAME, "1", "odisar.decision")
    client.delete_registered_model_alias(NAME, "champion")
    assert registered(root, bundle).is_champion
    client.delete_model_version_tag(NAME, "1", "odisar.decision")
    assert "version 1 became the champion" in registered(root, bundle).decision


def test_the_better_of_two_on_the_same_recordings_is_the_champion(root, bundle, client):
    registered(root, bundle)
    set_content(root, 2)
    worse = registered(root, bundle, development_score(0.8))
    assert (worse.version, worse.is_champion) == ("2", False)
    set_content(root, 3)
    better = registered(root, bundle, development_score(0.95))
    assert (better.version, better.is_champion) == ("3", True)
    assert str(client.get_model_version_by_alias(NAME, "champion").version) == "3"
    assert "0.950000" in better.line
    assert "0.900000" in better.line


def test_on_other_recordings_the_champion_is_measured_again(root, bundle):
    registered(root, bundle)
    set_content(root, 2)
    again = development_score(0.97, "b")
    done = registered(root, bundle, development_score(0.95, "b"), lambda _deployed: again)
    assert not done.is_champion
    assert "0.970000" in done.decision


def test_a_champion_that_cannot_be_measured_again_stays(root, bundle):
    registered(root, bundle)
    set_content(root, 2)
    done = registered(root, bundle, development_score(0.95, "b"), of_other_channels)
    assert not done.is_champion
    assert "its channels are others" in done.decision
    assert f"odisar promote {NAME} 2" in done.decision


def test_without_development_recordings_the_alias_stays_and_can_be_moved(
    root, bundle, client, monkeypatch, capsys
):
    registered(root, bundle, development_score(None))
    set_content(root, 2)
    done = registered(root, bundle, development_score(None))
    assert not done.is_champion
    assert "no disturbed development recordings" in done.decision
    monkeypatch.chdir(root)
    assert main(["promote", NAME, "2"]) == 0
    assert "version 2 became the champion by hand; it was version 1" in capsys.readouterr().out
    assert str(client.get_model_version_by_alias(NAME, "champion").version) == "2"
    assert main(["promote", NAME, "7"]) == 1
    assert "versions of this one: 2, 1" in capsys.readouterr().err


def test_what_does_not_exist_is_named(root, bundle):
    registered(root, bundle)
    with pytest.raises(OdisarError, match=f"registered models: {NAME}; versions of this one: none"):
        load_model(root, "trial.other", "champion")
    with pytest.raises(OdisarError, match="no version or alias '9'"):
        load_model(root, NAME, "9")


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


def rewrite_manifest(folder: Path) -> None:
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["origin"]["member"] = "another"
    (folder / "manifest.json").write_text(json.dumps(manifest))


@pytest.mark.parametrize(
    "tamper",
    [
        lambda folder: flip(folder / "weights.safetensors"),
        lambda folder: (folder / "capability.json").write_text("{}"),
        lambda folder: (folder / "masks.safetensors").unlink(),
        lambda folder: (folder / "extra.json").write_text("{}"),
        rewrite_manifest,
    ],
)
def test_a_changed_bundle_is_not_loaded(root, bundle, client, tamper):
    registered(root, bundle)
    (folder,) = (stored(client) / "artifacts").iterdir()
    tamper(folder)
    with pytest.raises(OdisarError, match="not what was registered"):
        load_model(root, NAME, "champion")
    set_content(root, 2)  # nor measured again as the champion
    assert (
        "not what was registered" in registered(root, bundle, development_score(0.95, "b")).decision
    )


def test_a_bundle_rewritten_with_its_manifest_is_refused_by_the_tag(
    root, bundle, client, trained_twin
):
    """Consistent in itself, so that only the registry's tag can tell."""
    registered(root, bundle)
    (folder,) = (stored(client) / "artifacts").iterdir()
    forged = write_small_bundle(folder, trained_twin, content="k2")
    read_bundle(forged)
    with pytest.raises(OdisarError, match=r"manifest are not what .* \(tag odisar.manifest_sha"):
        load_model(root, NAME, "champion")


def test_changed_code_is_not_run(root, bundle, client):
    registered(root, bundle)
    with (stored(client) / "served_model.py").open("a") as file:
        file.write("raise SystemExit('ran')\n")
    with pytest.raises(OdisarError, match="model's files are not what was registered"):
        load_model(root, NAME, "champion")


def test_byte_code_in_the_store_is_neither_in_the_way_nor_run(root, bundle, client):
    registered(root, bundle)
    cache = stored(client) / "code/odisar/__pycache__"
    cache.mkdir()
    (cache / "errors.cpython-311.pyc").write_bytes(b"planted")
    load_model(root, NAME, "champion")
    newest = max(Path(tempfile.gettempdir()).glob("odisar-model-*"), key=os.path.getmtime)
    assert (newest / "code/odisar/errors.py").exists()
    assert not list(newest.rglob("__pycache__"))


def test_mlflow_alone_holds_the_bundle_against_its_manifest(root, bundle, client):
    registered(root, bundle)
    (folder,) = (stored(client) / "artifacts").iterdir()
    flip(folder / "weights.safetensors")
    with pytest.raises(OdisarError, match=r"weights\.safetensors has been changed"):
        mlflow.pyfunc.load_model(f"models:/{NAME}@champion")


def test_it_loads_in_a_process_of_its_own_with_the_code_it_came_with(
    root, bundle, client, tmp_path
):
    registered(root, bundle)
    table_of(pushed()).to_json(tmp_path / "table.json", orient="split")
    script = """
import sys, mlflow, pandas as pd
mlflow.set_tracking_uri(sys.argv[1])
model = mlflow.pyfunc.load_model(sys.argv[2])
table = pd.read_json(sys.argv[3], orient="split", precise_float=True).astype(float)
said = model.predict(table)
import odisar
print(odisar.__file__)
print(said.to_json(orient="records", double_precision=15))
heavy = {"lightning", "optuna", "sklearn", "matplotlib", "ruamel", "dvc"} & set(sys.modules)
print(sorted(heavy))
"""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-c", script, tracking_uri(root), f"models:/{NAME}@champion",
         str(tmp_path / "table.json")],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    code, said, heavy = done.stdout.strip().splitlines()[-3:]
    assert Path(code).is_relative_to(stored(client) / "code")
    wanted = read_bundle(bundle).assess(table_of(pushed()))
    # Scores are in single precision, and libraries may have other numbers of threads there.
    pd.testing.assert_frame_equal(
        pd.DataFrame(json.loads(said)), wanted, check_exact=False, rtol=1e-6
    )
    assert heavy == "[]"
