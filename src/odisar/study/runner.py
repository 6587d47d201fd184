"""Run one part of the study."""

import importlib
from pathlib import Path

from odisar.artifacts import Workspace
from odisar.config.loader import ConfigView, load_config
from odisar.errors import OdisarError
from odisar.stages.parallel import prepare_jobs
from odisar.twin.devices import use_one_thread

#: Parts by the module that runs them.
PARTS = (
    "alternatives",
    "comparing",
    "confidence",
    "confirmation",
    "development",
    "forecasting",
    "leakage",
    "seeds",
)

#: Those that run several processes.
_SIDE_BY_SIDE = ("alternatives", "confidence", "forecasting", "seeds")

#: Those that are run once for each set-up.
OF_ONE_SETUP = ("alternatives", "confidence", "confirmation", "forecasting", "seeds")


def run_part(name: str, setup: str | None, root: Path) -> None:
    """Run the part ``name`` in the workspace ``root``, for one set-up or for all.

    Raises OdisarError for an unknown part or set-up, or where the pipeline hasn't run yet.
    """
    use_one_thread()
    if name not in PARTS:
        raise OdisarError(f"the study has no part {name!r}; parts are {', '.join(PARTS)}")
    config, workspace = load_config(root), Workspace(root)
    module = f"odisar.study.{name}"
    if name in _SIDE_BY_SIDE:
        prepare_jobs(module, config.pipeline.workers)
    part = importlib.import_module(module)
    if setup is not None and setup not in config.study.setups:
        raise OdisarError(
            f"set-up {setup!r} is not among study.setups: {', '.join(config.study.setups)}"
        )
    if not workspace.evaluate.is_dir():
        raise OdisarError("the study stands on the pipeline's results; run `make repro` first")
    view = ConfigView(config, part.PARAMS)
    takes_setup = name in OF_ONE_SETUP
    if takes_setup and setup is None:
        raise OdisarError(f"part {name!r} is run for one set-up: say which, as `study {name} NAME`")
    if setup is not None and not takes_setup:
        raise OdisarError(f"part {name!r} is run for all set-ups at once; leave {setup!r} out")
    if setup is None:
        part.run(view, workspace)
    else:
        part.run(view, workspace, setup)
