"""Named seeds, all derived from the one base seed in ``params.yaml``.

Deriving by name (rather than by order of use) keeps every stream of random numbers where it was
when another part of the pipeline draws more or fewer of them.
"""

import hashlib

import numpy as np

_SEED_BITS = 63


def derive_seed(base_seed: int, *names: str | int) -> int:
    """Return a 63-bit seed for the stream called ``names``, from the base seed.

    The same arguments give the same seed on every machine and Python version.
    """
    text = "/".join(str(part) for part in (base_seed, *names))
    digest = hashlib.sha256(text.encode()).digest()
    return int.from_bytes(digest[:8], "big") >> (64 - _SEED_BITS)


def generator(base_seed: int, *names: str | int) -> np.random.Generator:
    """Return a NumPy generator for the stream called ``names``."""
    return np.random.default_rng(derive_seed(base_seed, *names))
