"""A bundle is read as it was written, and refused, with a sentence, where it was not."""

import hashlib
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import torch

from odisar.deployment.bundle import read_bundle, write_bundle
from odisar.deployment.manifest import FILE_LIMIT, MANIFEST_LIMIT, SCHEMA_VERSION, Origin
from odisar.errors import OdisarError
from odisar.windows.scaling import Scaler
from small_bundle import (
    MAX_ROWS,
    small_case,
    small_example,
    small_settings,
    write_small_bundle,
)

ORIGIN = Origin(setup="small", case="system", member="small", members=1, content="k1")


@pytest.fixture
def bundle(written, tmp_path):
    """Return a bundle's copy that may be spoilt."""
    return shutil.copytree(written, tmp_path / "bundle")


def refusal(folder):
    with pytest.raises(OdisarError) as caught:
        read_bundle(folder)
    return str(caught.value)


def edit(path, change):
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def seal(folder, name):
    """Let the manifest agree with a changed file, as a careful forger would."""
    data = (folder / name).read_bytes()
    entry = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    edit(folder / "manifest.json", lambda content: content["files"].update({name: entry}))


def edit_sealed(folder, name, change):
    edit(folder / name, change)
    seal(folder, name)


def test_what_was_written_is_read(deployed, trained_twin):
    assert deployed.manifest.origin == ORIGIN
    assert deployed.settings == small_settings(trained_twin)
    assert deployed.case == small_case()
    assert deployed.twin.channel_names == trained_twin.channel_names
    for name, weights in trained_twin.network.state_dict().items():
        assert torch.equal(deployed.twin.network.state_dict()[name], weights)


def test_equal_input_gives_equal_bytes(trained_twin, written, tmp_path):
    again = write_small_bundle(tmp_path / "again", trained_twin)
    names = sorted(path.name for path in written.iterdir())
    assert names == sorted(path.name for path in again.iterdir())
    assert all((again / name).read_bytes() == (written / name).read_bytes() for name in names)


def test_there_is_no_pickle_in_it(written):
    assert {path.suffix for path in written.iterdir()} == {".json", ".safetensors"}


def test_a_bundle_is_replaced_and_another_folder_is_not(bundle, trained_twin, tmp_path):
    (bundle / "surplus.txt").write_text("left over")
    read_bundle(write_small_bundle(bundle, trained_twin))
    (tmp_path / "home").mkdir()
    (tmp_path / "home/thesis.txt").write_text("dear")
    with pytest.raises(OdisarError, match="no bundle; name another folder"):
        write_small_bundle(tmp_path / "home", trained_twin)
    assert (tmp_path / "home/thesis.txt").exists()


def test_a_folder_that_is_none_is_refused(tmp_path):
    assert "is no folder" in refusal(tmp_path / "nowhere")


def test_a_folder_without_manifest_is_refused(bundle):
    (bundle / "manifest.json").unlink()
    assert "manifest.json is missing" in refusal(bundle)


@pytest.mark.parametrize("name", ["weights.safetensors", "masks.safetensors", "twin.json"])
def test_a_flipped_byte_is_noticed(bundle, name):
    data = bytearray((bundle / name).read_bytes())
    data[len(data) // 2] ^= 1
    (bundle / name).write_bytes(data)
    assert f"{name} has been changed" in refusal(bundle)


def test_an_edited_threshold_is_noticed(bundle):
    text = (bundle / "capability.json").read_text()
    (bundle / "capability.json").write_text(text.replace("0.2,", "0.9,"))
    assert "capability.json has been changed" in refusal(bundle)


def test_a_removed_file_is_noticed(bundle):
    (bundle / "masks.safetensors").unlink()
    said = refusal(bundle)
    assert "masks.safetensors is missing" in said
    assert "dvc repro" in said


@pytest.mark.parametrize("name", ["model.pkl", ".hidden", "sub/folder.json"])
def test_an_added_file_is_noticed(bundle, name):
    (bundle / name).parent.mkdir(exist_ok=True)
    (bundle / name).write_text("{}")
    assert "is not listed in manifest.json" in refusal(bundle)


def test_a_link_is_no_file(bundle, tmp_path):
    shutil.move(bundle / "twin.json", tmp_path / "elsewhere.json")
    (bundle / "twin.json").symlink_to(tmp_path / "elsewhere.json")
    assert "twin.json is no plain file" in refusal(bundle)


def test_a_truncated_file_is_noticed(bundle):
    data = (bundle / "weights.safetensors").read_bytes()
    (bundle / "weights.safetensors").write_bytes(data[:-100])
    assert f"has {len(data) - 100} bytes, not the {len(data)}" in refusal(bundle)


def test_a_newer_schema_names_the_odisar_to_use(bundle):
    edit(
        bundle / "manifest.json",
        lambda content: content.update(schema_version=SCHEMA_VERSION + 1, odisar="9.1.0", new={}),
    )
    assert "use odisar 9.1.0 or newer" in refusal(bundle)


@pytest.mark.parametrize("version", [0, -1, "1", None, True, 1.5])
def test_an_unknown_schema_is_refused(bundle, version):
    edit(bundle / "manifest.json", lambda content: content.update(schema_version=version))
    assert "is not known" in refusal(bundle)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda content: content.pop("origin"), "origin: Field required"),
        (lambda content: content.update(note="x"), "note: Extra inputs"),
        (lambda content: content["files"].update({"../x": {}}), "should match pattern"),
        (lambda content: content["files"]["twin.json"].update(sha256="0"), "sha256"),
        (lambda content: content["files"]["twin.json"].update(bytes=FILE_LIMIT + 1), "bytes"),
        (lambda content: content["origin"].update(members=0), "origin.members"),
    ],
)
def test_a_malformed_manifest_is_refused(bundle, change, complaint):
    edit(bundle / "manifest.json", change)
    assert complaint in refusal(bundle)


@pytest.mark.parametrize("text", ["", "{", "[]", "3", "\ud83d", '{"a": NaN}', "[" * 100_000])
def test_a_manifest_that_is_no_json_object_is_refused(bundle, text):
    (bundle / "manifest.json").write_text(text, errors="surrogatepass")
    said = refusal(bundle)
    assert "manifest.json" in said
    assert "JSON" in said


def test_a_manifest_too_long_to_be_one_is_not_read(bundle):
    (bundle / "manifest.json").write_bytes(b" " * (MANIFEST_LIMIT + 1))
    assert "more than the" in refusal(bundle)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda content: content["thresholds"].update(variance=0), "thresholds.variance"),
        (lambda content: content["thresholds"].update(reconstruction=-1), "reconstruction"),
        (lambda content: content["thresholds"].update(reconstruction=1e999), "JSON"),
        (lambda content: content["sigma"].update(odisar=0), "sigma.odisar"),
        (lambda content: content.update(max_rows=0), "max_rows"),
        (lambda content: content.update(max_rows=str(MAX_ROWS)), "max_rows"),
        (lambda content: content.update(note=1), "note: Extra inputs"),
    ],
)
def test_settings_that_make_no_sense_are_refused_even_if_sealed(bundle, change, complaint):
    edit_sealed(bundle, "capability.json", change)
    said = refusal(bundle)
    assert "capability.json" in said
    assert complaint in said


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda tied: tied.update(states=[0, 2]), "are not of the twin's 2 states"),
        (lambda tied: [row.append(0.0) for row in tied["weights"]], "with 13 weights each"),
    ],
)
def test_relations_of_another_twin_are_refused_even_if_sealed(bundle, change, complaint):
    edit_sealed(
        bundle, "capability.json", lambda content: change(content["innovation"]["relations"])
    )
    assert complaint in refusal(bundle)


def test_a_score_of_other_states_is_refused_even_if_sealed(bundle):
    def change(content):
        content["innovation"]["consistency"]["recent"]["precision"] = [[1.0]]

    edit_sealed(bundle, "capability.json", change)
    assert "covariances of [1, 2] states" in refusal(bundle)


def test_a_case_of_other_channels_is_refused_even_if_sealed(bundle):
    edit_sealed(bundle, "case.json", lambda content: content["channels"].reverse())
    assert "differ in channels" in refusal(bundle)


def test_a_case_of_another_window_is_refused_even_if_sealed(bundle):
    edit_sealed(bundle, "case.json", lambda content: content["window"].update(context_steps=25))
    assert "differ in context_steps: 20 and 25" in refusal(bundle)


def test_a_case_that_is_none_is_refused_even_if_sealed(bundle):
    edit_sealed(bundle, "case.json", lambda content: content.update(rate_hz="fast"))
    assert "case.json: rate_hz" in refusal(bundle)


@pytest.mark.parametrize(
    "change",
    [
        lambda content: content.pop("spec"),
        lambda content: content.update(spec=3),
        lambda content: content["config"].update(model_dim=32),
        lambda content: content.update(channel_names=None),
        lambda content: content.update(scaler=[]),
    ],
)
def test_a_twin_that_is_none_is_refused_even_if_sealed(bundle, change):
    edit_sealed(bundle, "twin.json", change)
    said = refusal(bundle)
    assert "not a trained twin" in said
    assert "write the bundle again" in said


def test_truncated_safetensors_are_refused_even_if_sealed(bundle):
    data = (bundle / "weights.safetensors").read_bytes()
    (bundle / "weights.safetensors").write_bytes(data[: len(data) // 2])
    seal(bundle, "weights.safetensors")
    assert "not a trained twin" in refusal(bundle)


def test_another_schema_of_assessments_is_refused_even_if_sealed(bundle):
    edit_sealed(bundle, "assessment.schema.json", lambda content: content.update(title="Other"))
    assert "use odisar" in refusal(bundle)


def test_a_twin_without_spread_is_refused(trained_twin, tmp_path):
    spread = trained_twin.scaler.std.copy()
    for value, complaint in ((np.nan, "finite number"), (0.0, "greater than 0")):
        spread[1] = value
        scaler = Scaler(**vars(trained_twin.scaler) | {"std": spread})
        twin = replace(trained_twin, scaler=scaler)
        write_bundle(
            tmp_path / complaint[:3],
            twin,
            small_case(),
            small_settings(trained_twin),
            ORIGIN,
            small_example(),
        )
        assert complaint in refusal(tmp_path / complaint[:3])
