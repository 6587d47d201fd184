"""A bundle whose parts do not fit each other is refused, though its manifest was made to agree."""

import hashlib
import json
import shutil

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from odisar.deployment.bundle import read_bundle
from odisar.errors import OdisarError

HUGE = 10**400


@pytest.fixture
def bundle(written, tmp_path):
    """Return a bundle's copy that may be spoilt."""
    return shutil.copytree(written, tmp_path / "bundle")


def refusal(folder):
    with pytest.raises(OdisarError) as caught:
        read_bundle(folder)
    return str(caught.value)


def seal(folder, name):
    """Let the manifest agree with a changed file, as a careful forger would."""
    data = (folder / name).read_bytes()
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["files"][name] = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    (folder / "manifest.json").write_text(json.dumps(manifest))


def forge(folder, name, change):
    content = json.loads((folder / name).read_text())
    change(content)
    (folder / name).write_text(json.dumps(content))
    seal(folder, name)


def forge_tensors(folder, name, change):
    with safe_open(folder / name, framework="pt") as file:
        metadata = file.metadata()
    tensors = {key: value.clone() for key, value in load_file(folder / name).items()}
    change(tensors)
    save_file(tensors, folder / name, metadata=metadata)
    seal(folder, name)


@pytest.mark.parametrize("key", ["mean", "std", "target_mean", "target_std"])
@pytest.mark.parametrize(
    "values",
    [None, 1.0, [1.0], [1.0] * 4, [[1.0, 1.0]], ["1"] * 3, [None] * 3, [HUGE] * 3, [1e40] * 3],
)
def test_a_scaling_of_another_shape_or_kind_is_refused(bundle, key, values):
    wrong = values
    if key.startswith("target") and isinstance(values, list) and len(values) == 3:
        wrong = values[:2]  # of the right length, so that the values alone are wrong
    forge(bundle, "twin.json", lambda content: content["scaler"].update({key: wrong}))
    assert "twin.json: " in refusal(bundle)


@pytest.mark.parametrize("key", ["std", "target_std"])
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_a_spread_that_is_not_above_zero_is_refused(bundle, key, value):
    forge(bundle, "twin.json", lambda content: content["scaler"][key].__setitem__(0, value))
    assert f"twin.json: scaler.{key}.0" in refusal(bundle)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"outputs": [1.0, 2.0]}, "spec.outputs.0"),
        ({"outputs": [1, 3]}, "are not among 3 channels"),
        ({"outputs": [-2, 2]}, "spec.outputs.0"),
        ({"outputs": [1, 1]}, "are not among 3 channels"),
        ({"outputs": [0, 2]}, "differ in outputs"),
        ({"known_ahead": [0.0]}, "spec.known_ahead.0"),
        ({"known_ahead": [7]}, "are not among 3 channels"),
        ({"context_steps": 20.0}, "spec.context_steps"),
        ({"context_steps": 22}, "no multiple"),
        ({"context_steps": 100_005}, "spec.context_steps"),
        ({"horizon_steps": 10**30}, "spec.horizon_steps"),
        ({"pose": 3}, "spec.pose"),
        ({"pose": {"x": 1, "y": 2, "heading": [9], "in_degrees": False}}, "are not among 3"),
        ({"pose": {"x": 1, "y": 2, "heading": [0], "in_degrees": False}}, "pose"),
    ],
)
def test_windows_of_another_kind_are_refused(bundle, changes, complaint):
    forge(bundle, "twin.json", lambda content: content["spec"].update(changes))
    said = refusal(bundle)
    assert "twin.json" in said
    assert complaint in said


@pytest.mark.parametrize(
    "changes",
    [
        {"model_dim": 60_000},
        {"model_dim": 4096, "layers": 64, "feedforward_dim": 16_384},
        {"layers": 10**30},
        {"layers": 2},
        {"heads": 65},
        {"feedforward_dim": 10**6},
        {"reconstruction_dim": 10**6},
        {"patch_steps": 10**30},
    ],
)
def test_a_description_of_a_larger_network_is_refused_before_it_is_built(
    bundle, changes, monkeypatch
):
    on_the_processor = torch.nn.Linear.reset_parameters

    def build(layer):
        assert layer.weight.is_meta, "memory was taken"
        on_the_processor(layer)

    monkeypatch.setattr(torch.nn.Linear, "reset_parameters", build)
    forge(bundle, "twin.json", lambda content: content["config"].update(changes))
    assert "twin.json" in refusal(bundle)


@pytest.mark.parametrize("changes", [{"heads": 4}, {"dropout": 0.5}, {"dropout": 0.0}])
def test_what_was_not_trained_is_refused_though_the_shapes_fit(bundle, changes):
    forge(bundle, "twin.json", lambda content: content["config"].update(changes))
    assert "weights.safetensors was trained with another config" in refusal(bundle)


def first(tensors, change):
    name = next(iter(tensors))
    tensors[name] = change(tensors[name])


def shortened(tensors, draws):
    tensors.update({name: mask[:draws].clone() for name, mask in tensors.items()})


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda masks: masks.pop(next(iter(masks))), "missing"),
        (lambda masks: masks.update(other=masks.pop(next(iter(masks)))), "missing"),
        (lambda masks: masks.update(other=torch.ones(6, 1, 1, dtype=torch.uint8)), "unknown"),
        (lambda masks: first(masks, lambda mask: mask[:, :1].clone()), "describes"),
        (lambda masks: first(masks, lambda mask: mask[:3].clone()), "describes"),
        (lambda masks: first(masks, lambda mask: mask[0].clone()), "describes"),
        (lambda masks: first(masks, lambda mask: mask.float()), "describes"),
        (lambda masks: first(masks, lambda mask: mask.to(torch.int8)), "describes"),
        (lambda masks: first(masks, lambda mask: mask * 2), "other values than 0 and 1"),
        (lambda masks: shortened(masks, 1), "1 draws"),
        (lambda masks: shortened(masks, 0), "0 draws"),
        (lambda masks: masks.clear(), "0 draws"),
    ],
)
def test_masks_that_do_not_fit_the_twin_are_refused(bundle, change, complaint):
    forge_tensors(bundle, "masks.safetensors", change)
    said = refusal(bundle)
    assert "masks.safetensors" in said
    assert complaint in said


def test_masks_of_the_decoder_alone_are_taken(bundle):
    def keep_decoder(masks):
        for name in [name for name in masks if not name.startswith("decoder.")]:
            del masks[name]

    forge_tensors(bundle, "masks.safetensors", keep_decoder)
    assert len(read_bundle(bundle).twin.masks) > 1


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda weights: first(weights, lambda part: part.to(torch.int32)), "I32"),
        (lambda weights: first(weights, lambda part: part.double()), "F64"),
        (lambda weights: first(weights, lambda part: part * float("nan")), "NaN or infinity"),
        (lambda weights: first(weights, lambda part: part + float("inf")), "NaN or infinity"),
        (lambda weights: weights.update(other=torch.ones(1)), "unknown"),
    ],
)
def test_weights_that_are_none_are_refused(bundle, change, complaint):
    forge_tensors(bundle, "weights.safetensors", change)
    said = refusal(bundle)
    assert "weights.safetensors" in said
    assert complaint in said


@pytest.mark.parametrize(
    "change",
    [
        lambda content: content["columns"].__setitem__(1, "Wind"),
        lambda content: content["columns"].pop(),
        lambda content: content["columns"].append("Wind"),
        lambda content: content["data"].__setitem__(3, [1.0]),
        lambda content: content["data"].__delitem__(slice(5, None)),
        lambda content: content["data"][4].__setitem__(1, 1e300),
    ],
)
def test_an_example_that_is_not_assessed_is_refused(bundle, change):
    forge(bundle, "example.json", change)
    assert "example.json" in refusal(bundle)


@pytest.mark.parametrize("rate_hz", [1e308, HUGE, 2.0])
def test_a_rate_that_is_not_the_examples_is_refused(bundle, rate_hz):
    forge(bundle, "case.json", lambda content: content.update(rate_hz=rate_hz))
    assert ".json" in refusal(bundle)


@pytest.mark.parametrize(
    "text", ["[" * 100_000, " " * 16_000_001, "null", "[]", '{"a": ' + "9" * 5000 + "}"]
)
def test_a_description_that_is_none_is_refused(bundle, text):
    (bundle / "twin.json").write_text(text)
    seal(bundle, "twin.json")
    assert "twin.json: " in refusal(bundle) or "twin.json is longer" in refusal(bundle)
