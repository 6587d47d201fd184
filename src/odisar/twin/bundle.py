"""A trained twin on disk: weights and dropout masks in safetensors, everything else in JSON.

A file may have been meddled with: names, types and shapes of the tensors are compared before
anything is built, so that no file asks for more memory than it fills itself.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Self

import numpy as np
import torch
from pydantic import Field, ValidationError, model_validator
from safetensors import SafetensorError, safe_open
from safetensors.torch import load_file, save_file

from odisar.config.base import Section
from odisar.config.learning import Steps, TwinConfig
from odisar.errors import OdisarError
from odisar.twin.layers import Dropout
from odisar.twin.transformer import TwinTransformer
from odisar.windows.coordinates import PoseChannels
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSpec

_WEIGHTS, _MASKS, _DESCRIPTION = "weights.safetensors", "masks.safetensors", "twin.json"
#: Key in the metadata of the weights: the configuration they were trained with, as JSON.
_TRAINED = "odisar.twin"
_DESCRIPTION_LIMIT = 16_000_000
_CHANNELS_LIMIT = 10_000
#: Beyond it a number times a few others is no float32 any more.
_NUMBER_LIMIT = 1e30

_Index = Annotated[int, Field(ge=0, lt=_CHANNELS_LIMIT)]
_Number = Annotated[float, Field(ge=-_NUMBER_LIMIT, le=_NUMBER_LIMIT)]
_Spread = Annotated[float, Field(gt=0, le=_NUMBER_LIMIT)]
#: Type and shape by name of tensor.
_Layout = dict[str, tuple[str, tuple[int, ...]]]


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


class _Pose(Section):
    x: _Index
    y: _Index
    heading: Annotated[list[_Index], Field(min_length=1, max_length=2)]
    in_degrees: bool

    def as_channels(self) -> PoseChannels:
        return PoseChannels(self.x, self.y, tuple(self.heading), self.in_degrees)


class _Spec(Section):
    context_steps: Steps
    horizon_steps: Steps
    outputs: Annotated[list[_Index], Field(min_length=1)]
    commands: list[_Index]
    known_ahead: list[_Index]
    pose: _Pose | None

    def as_spec(self) -> WindowSpec:
        return WindowSpec(
            context_steps=self.context_steps,
            horizon_steps=self.horizon_steps,
            outputs=tuple(self.outputs),
            commands=tuple(self.commands),
            known_ahead=tuple(self.known_ahead),
            pose=None if self.pose is None else self.pose.as_channels(),
        )


class _Scaling(Section):
    mean: list[_Number]
    std: list[_Spread]
    target_mean: list[_Number]
    target_std: list[_Spread]


class _Description(Section):
    """What ``twin.json`` holds."""

    channel_names: Annotated[list[str], Field(min_length=1, max_length=_CHANNELS_LIMIT)]
    config: TwinConfig
    spec: _Spec
    scaler: _Scaling

    @model_validator(mode="after")
    def _check_positions(self) -> Self:
        spec, channels = self.spec.as_spec(), len(self.channel_names)
        pose = () if spec.pose is None else spec.pose.positions
        for what, positions in (
            ("outputs", spec.outputs),
            ("commands", spec.commands),
            ("known_ahead", spec.known_ahead),
            ("pose", pose),
        ):
            if len(set(positions)) < len(positions) or any(i >= channels for i in positions):
                raise ValueError(f"spec.{what}={list(positions)} are not among {channels} channels")
        if set(spec.commands) & set(pose):
            raise ValueError(f"spec.commands={list(spec.commands)}: a channel of the pose is none")
        for steps in ("context_steps", "horizon_steps"):
            if getattr(spec, steps) % self.config.patch_steps:
                raise ValueError(f"spec.{steps} is no multiple of config.patch_steps")
        return self

    @model_validator(mode="after")
    def _check_lengths(self) -> Self:
        features = self.spec.as_spec().feature_count(len(self.channel_names))
        for name, values in self.scaler.model_dump().items():
            wanted = len(self.spec.outputs) if name.startswith("target") else features
            if len(values) != wanted:
                raise ValueError(f"scaler.{name} has {len(values)} values, not {wanted}")
        return self


def write_twin(folder: Path, twin: TrainedTwin) -> None:
    """Write the twin into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    # One key: the order of several would not be the same every time.
    trained = {_TRAINED: json.dumps(twin.config.model_dump(), sort_keys=True)}
    save_file(twin.network.state_dict(), folder / _WEIGHTS, metadata=trained)
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
        described = _read_description(folder / _DESCRIPTION)
        config, spec = described.config, described.spec.as_spec()
        channels = len(described.channel_names)
        with torch.device("meta"):  # shapes alone, no memory
            planned = TwinTransformer(config, spec, channels)
        _check_weights(folder / _WEIGHTS, planned, config)
        masks = _read_masks(folder / _MASKS, planned)
        network = TwinTransformer(config, spec, channels)
        network.load_state_dict(load_file(folder / _WEIGHTS))
        scaler = Scaler(**{k: np.array(v) for k, v in described.scaler.model_dump().items()})
    except (OSError, ValueError, RuntimeError, ArithmeticError, SafetensorError) as error:
        raise OdisarError(
            f"{folder}: not a trained twin ({' '.join(str(error).split())}); run the train stage"
        ) from error
    names = tuple(described.channel_names)
    return TrainedTwin(network.eval(), config, spec, scaler, masks, names)


def _read_description(path: Path) -> _Description:
    if path.stat().st_size > _DESCRIPTION_LIMIT:
        raise ValueError(f"{path.name} is longer than {_DESCRIPTION_LIMIT} bytes")
    try:
        return _Description.model_validate(json.loads(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        problem = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, problem["loc"])) or "(whole file)"
        raise ValueError(f"{path.name}: {where}: {problem['msg']}") from error
    except (ValueError, OverflowError, RecursionError) as error:
        raise ValueError(f"{path.name}: {str(error)[:200]}") from error


def _check_weights(path: Path, planned: TwinTransformer, config: TwinConfig) -> None:
    """Raise ValueError unless the file holds the tensors of the network and of its training."""
    found, metadata = _read_header(path)
    # "float32" in torch is "F32" in the file; the network is never of another type.
    wanted: _Layout = {k: ("F32", tuple(v.shape)) for k, v in planned.state_dict().items()}
    _compare(path.name, found, wanted)
    trained = metadata.get(_TRAINED)  # not in twins of earlier versions
    if trained is not None and trained != json.dumps(config.model_dump(), sort_keys=True):
        raise ValueError(
            f"{path.name} was trained with another config than that of {_DESCRIPTION}: "
            f"{trained[:300]}"
        )


def _read_masks(path: Path, planned: TwinTransformer) -> dict[str, torch.Tensor]:
    """Return the masks; raise ValueError unless they are for all dropout sites or the decoder's."""
    found, _ = _read_header(path)
    sites = {
        k: (v.tokens, v.features) for k, v in planned.named_modules() if isinstance(v, Dropout)
    }
    if not any(name in found for name in sites if not name.startswith("decoder.")):
        sites = {name: shape for name, shape in sites.items() if name.startswith("decoder.")}
    draws = next((shape[0] for _, shape in found.values() if shape), 0)
    if draws < 2:
        raise ValueError(f"{path.name} holds {draws} draws; a variance takes 2 or more")
    _compare(path.name, found, {name: ("U8", (draws, *shape)) for name, shape in sites.items()})
    masks = load_file(path)
    if any(bool((mask > 1).any()) for mask in masks.values()):
        raise ValueError(f"{path.name}: a mask holds other values than 0 and 1")
    return masks


def _read_header(path: Path) -> tuple[_Layout, dict[str, str]]:
    with safe_open(path, framework="pt") as file:
        parts = {name: file.get_slice(name) for name in file.keys()}  # noqa: SIM118 (no mapping)
        layout = {name: (part.get_dtype(), tuple(part.get_shape())) for name, part in parts.items()}
        return layout, file.metadata() or {}


def _compare(file: str, found: _Layout, wanted: _Layout) -> None:
    for name in sorted(found.keys() ^ wanted.keys()):
        state = "unknown" if name in found else "missing"
        raise ValueError(f"{file}: {name[:60]!r} is {state}; {_DESCRIPTION} describes another twin")
    for name, layout in wanted.items():
        if found[name] != layout:
            raise ValueError(
                f"{file}: {name!r} is {found[name]}, but {layout} by what {_DESCRIPTION} describes"
            )
