"""Where torch computes, and with how many threads."""

import logging
import warnings

import torch

from odisar.errors import OdisarError


def use_one_thread() -> None:
    """Make torch repeatable and keep it to one thread: processes, not threads, fill the cores."""
    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(mode=True, warn_only=True)
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    warnings.filterwarnings("ignore", message=".*does not have many workers.*")
    warnings.filterwarnings("ignore", message=".*Checkpoint directory.*exists and is not empty.*")
    warnings.filterwarnings("ignore", message=".*isinstance.treespec, LeafSpec.*")


def pick_device(accelerator: str) -> str:
    """Return ``cuda`` or ``cpu`` as ``pipeline.accelerator`` asks for.

    Raises OdisarError where a GPU is asked for and there is none.
    """
    if accelerator == "gpu" and not torch.cuda.is_available():
        raise OdisarError(
            "pipeline.accelerator=gpu, but torch finds no CUDA GPU; say auto or cpu, or install a "
            "GPU build of torch (see the README)"
        )
    return "cuda" if accelerator != "cpu" and torch.cuda.is_available() else "cpu"
