"""Which simulator parameters made the recordings in ``data/``; tracked together with them."""

import json
from pathlib import Path

from odisar.errors import OdisarError


def recipe_file(root: Path) -> Path:
    """Return the file that maps a simulated case to the hash of its simulator's parameters."""
    return root / "data/made-from.json"


def check_recipe(root: Path, case_name: str, wanted: str | None) -> None:
    """Raise OdisarError where simulated recordings are not those of today's parameters.

    ``wanted`` is the hash of the parameters, None for recordings that no simulator makes.
    Recordings are no output of the pipeline: without this, a changed simulator parameter would be
    logged beside results that it had no part in.
    """
    if wanted is None:
        return
    path = recipe_file(root)
    found = json.loads(path.read_text(encoding="utf-8")).get(case_name) if path.exists() else None
    if found != wanted:
        raise OdisarError(
            f"the recordings of case {case_name!r} were made with other values under `simulators` "
            "in params.yaml; `make data` makes them anew (and `make accept-data` accepts them), or "
            "take the change back"
        )
