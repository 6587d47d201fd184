"""A trained twin on disk: weights and dropout masks in safetensors, everything else in JSON."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from odisar.config.learning import TwinConfig
from odisar.errors import OdisarError
from odisar.twin.transformer import TwinTransformer
from odisar.windows.coordinates import PoseChannels
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSpec

_WEIGHTS, _MASKS, _DESCRIPTION = "weights.safetensors", "masks.safetensors", "twin.json"


@dataclass(frozen=True)
class TrainedTwin:
    """A network, the scaling it was trained in, its stored dropout masks, and its channels."""

    network: TwinTransformer
    config: TwinConfig
    spec: WindowSpec
    scaler: Scaler
    masks: dict[str, torch.Tensor]
    channel_names: tuple[str, ...]

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the forecast states."""
        return tuple(self.channel_names[i] for i in self.spec.outputs)


def write_twin(folder: Path, twin: TrainedTwin) -> None:
    """Write the twin into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    save_file(twin.network.state_dict(), folder / _WEIGHTS)
    save_file(twin.masks, folder / _MASKS)
    description = {
        "channel_names": twin.channel_names,
        "config": twin.config.model_dump(),
        "spec": asdict(twin.spec),
        "scaler": {name: values.tolist() for name, values in vars(twin.scaler).items()},
    }
    text = json.dumps(description, indent=2, sort_keys=True)
    (folder / _DESCRIPTION).write_text(text + "\n", encoding="utf-8")


def read_twin(folder: Path) -> TrainedTwin:
    """Read a twin; raise OdisarError where a file is missing or does not fit the others."""
    try:
        description = json.loads((folder / _DESCRIPTION).read_text(encoding="utf-8"))
        config = TwinConfig.model_validate(description["config"])
        spec = _read_spec(description["spec"])
        channel_names = tuple(description["channel_names"])
        network = TwinTransformer(config, spec, spec.feature_count(len(channel_names)))
        network.load_state_dict(load_file(folder / _WEIGHTS))
        masks = load_file(folder / _MASKS)
        scaler = Scaler(**{k: np.array(v) for k, v in description["scaler"].items()})
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, SafetensorError) as error:
        raise OdisarError(
            f"{folder}: not a trained twin ({' '.join(str(error).split())}); run the train stage"
        ) from error
    return TrainedTwin(network.eval(), config, spec, scaler, masks, channel_names)


def _read_spec(values: dict[str, Any]) -> WindowSpec:
    pose = values["pose"]
    return WindowSpec(
        context_steps=values["context_steps"],
        horizon_steps=values["horizon_steps"],
        outputs=tuple(values["outputs"]),
        known_ahead=tuple(values["known_ahead"]),
        pose=None if pose is None else PoseChannels(**pose | {"heading": tuple(pose["heading"])}),
    )
