import dataclasses

import pytest
import torch

from odisar.config.learning import LearningRateRange, TuningConfig
from odisar.errors import OdisarError
from odisar.twin.bundle import read_twin, write_twin
from odisar.twin.checkpoints import SafetensorsCheckpointIO, read_checkpoint
from odisar.twin.training import train_twin
from odisar.twin.tuning import tune_twin, tuned_plan

TUNING = TuningConfig(
    trials=4,
    steps_per_trial=20,
    reports_per_trial=2,
    pruner_warmup_trials=2,
    learning_rate=LearningRateRange(low=1.0e-4, high=1.0e-2),
    model_dim=[8, 16],
    layers=[1],
    feedforward_dim=[32],
    storage="journal",
)


def weights(network: torch.nn.Module) -> torch.Tensor:
    return torch.cat([value.flatten() for value in network.state_dict().values()])


def test_training_learns_and_counts_what_it_saw(plan, windows, tmp_path):
    result = train_twin(plan, *windows, tmp_path)
    errors = [row["validation_loss"] for row in result.history]
    assert result.best_validation_loss == min(errors) < 0.9 * errors[0]
    assert result.windows_seen == 3 * 40 * 16
    assert {"train_forecast_mse", "train_reconstruction_mse"} <= set(result.history[0])


def test_the_same_seed_gives_the_same_weights_and_another_does_not(plan, windows, tmp_path):
    first = train_twin(plan, *windows, tmp_path / "a").network
    again = train_twin(plan, *windows, tmp_path / "b").network
    other = train_twin(dataclasses.replace(plan, seed=12), *windows, tmp_path / "c").network
    assert torch.equal(weights(first), weights(again))
    assert not torch.equal(weights(first), weights(other))


def test_training_stops_when_validation_stops_improving(plan, windows, tmp_path):
    hopeless = plan.training.model_copy(
        update={"learning_rate": 1.0e-12, "epochs": 9, "patience_epochs": 2, "steps_per_epoch": 5}
    )
    result = train_twin(dataclasses.replace(plan, training=hopeless), *windows, tmp_path)
    assert len(result.history) < 9


def test_checkpoints_hold_no_pickle_and_come_back_whole(tmp_path):
    content = {
        "epoch": 3,
        "state_dict": {"w": torch.arange(3.0)},
        "optimizer_states": [{"state": {0: {"step": torch.tensor(4.0)}}, "betas": (0.9, 0.99)}],
        "score": float("inf"),
        "nothing": None,
    }
    path = tmp_path / "deep" / "x.ckpt"
    SafetensorsCheckpointIO().save_checkpoint(content, path)
    back = read_checkpoint(path)
    assert back["optimizer_states"][0]["betas"] == (0.9, 0.99)
    assert back["optimizer_states"][0]["state"][0]["step"] == 4
    assert torch.equal(back["state_dict"]["w"], torch.arange(3.0))
    assert back["score"] == float("inf")
    assert back["nothing"] is None
    with pytest.raises(TypeError, match="neither tensor nor JSON"):
        SafetensorsCheckpointIO().save_checkpoint({"code": print}, path)


def test_a_twin_comes_back_from_its_folder(trained_twin, tmp_path):
    write_twin(tmp_path, trained_twin)
    back = read_twin(tmp_path)
    assert torch.equal(weights(back.network), weights(trained_twin.network))
    assert back.output_names == ("Speed", "Turn Rate")
    assert all(torch.equal(back.masks[k], v) for k, v in trained_twin.masks.items())


@pytest.mark.parametrize("name", ["weights.safetensors", "masks.safetensors", "twin.json"])
def test_a_damaged_twin_is_named(trained_twin, tmp_path, name):
    write_twin(tmp_path, trained_twin)
    (tmp_path / name).write_bytes(b"garbage")
    with pytest.raises(OdisarError, match="not a trained twin"):
        read_twin(tmp_path)


def test_tuning_starts_with_the_configured_values_and_resumes_to_the_same_end(
    plan, windows, tmp_path
):
    whole = tune_twin(plan, TUNING, windows, str(tmp_path / "a.journal"), "s")
    part = TUNING.model_copy(update={"trials": 2})
    tune_twin(plan, part, windows, str(tmp_path / "b.journal"), "s")
    resumed = tune_twin(plan, TUNING, windows, str(tmp_path / "b.journal"), "s")
    assert whole.trials[0]["training.learning_rate"] == plan.training.learning_rate
    assert whole.trials[0]["twin.model_dim"] == plan.twin.model_dim
    assert len(whole.trials) == 4
    assert whole == resumed


def test_tuned_values_replace_the_configured_ones(plan):
    tuned = tuned_plan(plan, {"twin.layers": 2, "training.learning_rate": 0.01})
    assert (tuned.twin.layers, tuned.training.learning_rate) == (2, 0.01)
    assert tuned.twin.model_dim == plan.twin.model_dim
    assert tuned.seed == plan.seed
