"""From parameters to a printed result: recordings, MLflow store, ``dvc repro``, headline table."""

import os
import subprocess
import sys
from pathlib import Path

from odisar.artifacts import Workspace, read_table
from odisar.config.loader import load_config
from odisar.errors import OdisarError
from odisar.making import make_recordings, run_dvc, track_recordings
from odisar.report.headline import headline_text
from odisar.stages.published import ensure_published
from odisar.tracking import ROOT_VARIABLE, initialise_store, tracking_root
from odisar.tracking.registry import model_name


def reproduce(root: Path) -> None:
    """Run everything that is not up to date in the workspace ``root``, and print what came out."""
    run_pipeline(root)
    print_results(root)


def workspace_of(root: Path, profile: str | None) -> Path:
    """Return the folder of a profile's results, or the project's own; it must have some."""
    folder = root / "workspaces" / profile if profile else root
    if not Workspace(folder).evaluate.is_dir():
        command = f"odisar profile {profile}" if profile else "make repro"
        raise OdisarError(
            f"{_shown(folder)}: nothing has been evaluated yet; run `{command}` first"
        )
    return folder


def rebuild_report(root: Path, profile: str | None = None) -> None:
    """Bring the report up to date, notebooks included, and print where it is.

    Raises OdisarError where nothing was evaluated yet: this is no way to start hours of training.
    """
    folder = workspace_of(root, profile)
    if profile:
        os.environ[ROOT_VARIABLE] = str(tracking_root(root))
    run_pipeline(folder)
    print(f"report: {_shown(Workspace(folder).report)}")  # noqa: T201


def run_pipeline(root: Path) -> None:
    """Make and check recordings, create the MLflow store, run what is not up to date."""
    make_recordings(root)
    track_recordings(root, accept=False)
    initialise_store(root)
    # The pipeline says `python`: it must be this one, whether or not .venv is activated.
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    command = [sys.executable, "-m", "dvc", "repro"]
    done = subprocess.run(command, cwd=root, env=os.environ | {"PATH": path}, check=False)
    if done.returncode:
        raise OdisarError("the pipeline stopped; what went wrong stands above")
    ensure_published(root)


def reproduce_profile(root: Path, workspace: Path) -> None:
    """Run a laid-out workspace; its runs go to the MLflow store of ``root``."""
    os.environ[ROOT_VARIABLE] = str(tracking_root(root))
    if not (workspace / ".dvc").exists():
        run_dvc(workspace, "init", "--no-scm", "--quiet")
        run_dvc(workspace, "config", "core.analytics", "false")
    make_recordings(workspace)
    (workspace / "data.dvc").unlink(missing_ok=True)  # a workspace accepts what it has made
    reproduce(workspace)


def print_results(root: Path) -> None:
    """Print the monitor's overall results and where to look further."""
    workspace = Workspace(root)
    print(f"\n{headline_text(read_table(workspace.results / 'detection.csv'))}\n")  # noqa: T201
    places = {
        "report": workspace.report,
        "results": workspace.results,
        "figures": workspace.figures,
    }
    for name, path in places.items():
        if not path.exists():
            continue
        print(f"{name:>8}: {_shown(path)}")  # noqa: T201
    print(f"{'runs':>8}: make ui    (MLflow, http://127.0.0.1:5000)")  # noqa: T201
    config = load_config(root)
    for setup in config.pipeline.setups:
        name = model_name(config.tracking.experiment, setup)
        print(f'{"model":>8}: load_model(Path("."), "{name}", "champion")')  # noqa: T201


def _shown(path: Path) -> Path:
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path
