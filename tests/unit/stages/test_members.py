import numpy as np
import pytest

from odisar.artifacts import Workspace
from odisar.config.loader import ConfigView, load_config
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.recordings.store import write_store
from odisar.stages.members import Member, load_member, pipeline_members
from odisar.stages.preprocess import PARAMS


def view(config, setups):
    pipeline = config.pipeline.model_copy(update={"setups": setups})
    return ConfigView(config.model_copy(update={"pipeline": pipeline}), PARAMS)


@pytest.fixture(scope="module")
def config(request):
    return load_config(request.config.rootpath)


@pytest.fixture
def workspace(tmp_path, config):
    """Twenty-four blocks of a made-up sea trial."""
    time_s = np.arange(24 * 230.0)
    random = np.random.default_rng(3)
    values = random.normal(size=(len(time_s), len(config.cases["gunnerus"].channels)))
    info = RecordingInfo("gunnerus", split="cross-fit")
    write_store(
        Workspace(tmp_path).recordings("gunnerus"), [Recording("trial", info, time_s, values)]
    )
    return Workspace(tmp_path)


def test_a_cross_fitted_set_up_has_a_member_for_each_fold(config):
    members = pipeline_members(view(config, ["gunnerus", "vessel-all"]))
    folds = [f"gunnerus.fold-{i}" for i in range(6)]
    assert [member.name for member in members] == [*folds, "vessel-all"]


def test_a_member_is_scaled_by_its_training_blocks_and_tested_on_faults_too(config, workspace):
    data = load_member(view(config, ["gunnerus"]), workspace, Member("gunnerus", 2))
    values = np.concatenate([item.values for item in data.splits["train"]])
    np.testing.assert_allclose(data.scaler.mean, values.mean(axis=0))
    faulty = [item for item in data.splits["test"] if item.info.is_disturbed]
    clean = [item for item in data.splits["test"] if not item.info.is_disturbed]
    assert len(clean) == 4
    assert {item.info.disturbance for item in faulty} == set(data.case.faults.kinds)
    assert not any(
        item.info.is_disturbed for part, group in data.splits.items() if part != "test"
        for item in group
    )  # fmt: skip


def test_no_fold_is_calibrated_validated_or_trained_on_what_it_tests(config, workspace):
    names = []
    for fold in range(6):
        splits = load_member(view(config, ["gunnerus"]), workspace, Member("gunnerus", fold)).splits
        by_part = {p: {item.info.base_seed for item in group} for p, group in splits.items()}
        others = by_part["train"] | by_part["validation"] | by_part["calibration"]
        assert not by_part["test"] & others
        names += sorted(by_part["test"])
    assert len(names) == len(set(names)) == 24
