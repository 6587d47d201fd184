"""A logged model: which of its files count, and what does not belong in a download."""

import mlflow
import pytest

from odisar.tracking.logged_model import download, model_hash


@pytest.fixture
def model(tmp_path):
    folder = tmp_path / "model"
    (folder / "code").mkdir(parents=True)
    (folder / "MLmodel").write_text("flavors: {}")
    return folder


def test_only_the_file_that_mlflow_adds_to_a_download_does_not_count(model):
    before = model_hash(model)
    (model / "registered_model_meta").write_text("model_name: x")
    assert model_hash(model) == before
    for name in (
        "registered_model_meta.py",
        "code/registered_model_meta",
        "a_registered_model_meta",
    ):
        (model / name).write_text("")
        assert model_hash(model) != before
        (model / name).unlink()
    assert model_hash(model) == before


def test_byte_code_is_left_out_whatever_it_is(model, tmp_path, monkeypatch):
    (model / "code/__pycache__").mkdir()
    (model / "code/__pycache__/a.pyc").write_bytes(b"planted")
    (model / "__pycache__").write_text("a file")
    (tmp_path / "elsewhere").mkdir()
    (model / "code/deep").mkdir()
    (model / "code/deep/__pycache__").symlink_to(tmp_path / "elsewhere")
    monkeypatch.setattr(mlflow.artifacts, "download_artifacts", lambda **_: None)
    download("models:/m/1", model)
    assert not [path for path in model.rglob("*") if path.name == "__pycache__"]
    assert (tmp_path / "elsewhere").is_dir()
