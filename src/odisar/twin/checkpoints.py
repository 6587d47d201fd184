"""Checkpoints without pickle: tensors in safetensors, everything else as JSON in its header."""

import json
from pathlib import Path
from typing import Any

import torch
from lightning.fabric.plugins.io.checkpoint_io import CheckpointIO
from safetensors import safe_open
from safetensors.torch import save_file

_TENSOR, _PAIRS, _TUPLE = "__tensor__", "__pairs__", "__tuple__"


class SafetensorsCheckpointIO(CheckpointIO):
    """Reads and writes Lightning's checkpoints; a file appears whole or not at all."""

    def save_checkpoint(
        self, checkpoint: dict[str, Any], path: str | Path, storage_options: object = None
    ) -> None:
        """Write beside the target and rename, so that a kill leaves the previous file intact."""
        del storage_options
        tensors: dict[str, torch.Tensor] = {}
        header = json.dumps(_pack(checkpoint, tensors))
        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        unfinished = target.with_name(target.name + ".part")
        save_file(tensors, unfinished, metadata={"checkpoint": header})
        unfinished.replace(target)

    def load_checkpoint(
        self,
        path: str | Path,
        map_location: object = None,
        weights_only: bool | None = None,  # noqa: FBT001 (Lightning's interface)
    ) -> dict[str, Any]:
        """Read a checkpoint; nothing in it can run code."""
        del map_location, weights_only
        return read_checkpoint(Path(path))

    def remove_checkpoint(self, path: str | Path) -> None:
        """Delete a checkpoint that a better one has replaced."""
        Path(path).unlink(missing_ok=True)


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Return the checkpoint's nested dictionary, with its tensors on the CPU."""
    with safe_open(path, framework="pt") as opened:
        header = json.loads(opened.metadata()["checkpoint"])
        tensors = {key: opened.get_tensor(key) for key in opened.keys()}  # noqa: SIM118
    unpacked: dict[str, Any] = _unpack(header, tensors)
    return unpacked


def _pack(value: Any, tensors: dict[str, torch.Tensor]) -> Any:
    """Return ``value`` as JSON data; tensors move to ``tensors`` and leave their key behind.

    Dictionaries become lists of pairs, as an optimiser's state is keyed by integers.
    """
    match value:
        case torch.Tensor():
            key = str(len(tensors))
            tensors[key] = value.detach().cpu().clone().contiguous()
            return {_TENSOR: key}
        case dict():
            return {_PAIRS: [[_pack(k, tensors), _pack(v, tensors)] for k, v in value.items()]}
        case tuple():
            return {_TUPLE: [_pack(item, tensors) for item in value]}
        case list():
            return [_pack(item, tensors) for item in value]
        case None | bool() | int() | float() | str():
            return value
        case Path():
            return str(value)
    raise TypeError(
        f"a checkpoint holds a {type(value).__name__}, which is neither tensor nor JSON"
    )


def _unpack(value: Any, tensors: dict[str, torch.Tensor]) -> Any:
    match value:
        case {"__tensor__": key}:
            return tensors[key]
        case {"__pairs__": pairs}:
            return {_unpack(k, tensors): _unpack(v, tensors) for k, v in pairs}
        case {"__tuple__": items}:
            return tuple(_unpack(item, tensors) for item in items)
        case list():
            return [_unpack(item, tensors) for item in value]
    return value
