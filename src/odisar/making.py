"""Make the recordings of a workspace and hold them against ``data.dvc``."""

import json
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from odisar.config.loader import Config, load_config
from odisar.errors import OdisarError
from odisar.recordings.quality import Finding, raise_on_errors
from odisar.recordings.reader import read_case
from odisar.recordings.recipe import recipe_file
from odisar.recordings.schema import Recording
from odisar.recordings.writer import write_recordings
from odisar.simulators.robot.runs import simulate_robot
from odisar.simulators.vessel.runs import simulate_vessel
from odisar.sources.gunnerus import make_gunnerus
from odisar.sources.omni3 import make_omni3


def make_recordings(root: Path) -> None:
    """Make what the active cases lack; recordings that are there are left as they are.

    Simulated recordings are made again when the simulator's parameters have changed since. Raises
    OdisarError for a case that has neither recordings nor a way to make them.
    """
    config = load_config(root)
    for name in config.active_cases:
        source = config.cases[name].source
        folder = _tracked_folder(root, name, source.folder)
        if (wanted := config.recipe_of(name)) is not None:
            _simulate(config, name, folder, recipe_file(root), wanted)
        elif _has_recordings(folder):
            continue
        elif source.maker == "gunnerus-trial":
            make_gunnerus(config.sources.gunnerus, root, folder)
        elif source.maker == "omni3-runs":
            make_omni3(config.sources.omni3, root, folder)
        else:
            raise OdisarError(
                f"case {name!r}: there are no recordings in {source.folder}; put its CSV files "
                "there (see the README, 'Your own recordings')"
            )


def _tracked_folder(root: Path, case_name: str, folder: str) -> Path:
    """Return a case's folder; raise OdisarError for one that the pipeline would not track."""
    path = (root / folder).resolve()
    if not path.is_relative_to((root / "data").resolve()):
        raise OdisarError(
            f"cases.{case_name}.source.folder={folder}: the pipeline tracks recordings below data/ "
            "alone; declare the case in a profile, whose recordings may lie anywhere (`odisar "
            "new-case` does), or move the folder"
        )
    return path


def track_recordings(root: Path, *, accept: bool) -> None:
    """Bring the recordings into DVC's cache if they are those of ``data.dvc``.

    Raises OdisarError where they differ (unless ``accept``): with the bad files if there are any,
    else with the way to accept the difference.
    """
    if not (root / "data.dvc").exists():
        run_dvc(root, "add", "data", "--quiet")
        return
    if _is_accepted(root):
        return
    config = load_config(root)
    raise_on_errors(_findings(config, root))
    if not accept:
        raise OdisarError(
            "the recordings in data/ are not those of data.dvc: "
            f"{_described(root)}. If you changed or added recordings, or this CPU rounds "
            "differently from the one that made data.dvc, accept them with `make accept-data` and "
            "repeat; results will then differ from the committed ones. To get the project's own "
            "recordings back, move data/ away and repeat."
        )
    run_dvc(root, "commit", "data.dvc", "--force", "--quiet")
    print("accepted: data.dvc now describes the recordings in data/")  # noqa: T201


def run_dvc(root: Path, *arguments: str) -> str:
    """Return what a DVC command printed; raise OdisarError with its own words where it fails."""
    done = subprocess.run(
        [sys.executable, "-m", "dvc", *arguments],
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        words = (done.stderr or done.stdout).strip() or "it gave no reason"
        raise OdisarError(f"dvc {' '.join(arguments)} failed: {words}")
    return done.stdout.strip()


def _simulate(config: Config, name: str, folder: Path, recipe_path: Path, wanted: str) -> None:
    recipes = json.loads(recipe_path.read_text()) if recipe_path.exists() else {}
    found = recipes.get(name)
    if _has_recordings(folder):
        if found == wanted:
            return
        if found is None:
            raise OdisarError(
                f"{config.cases[name].source.folder} holds recordings, but {recipe_path.name} does "
                f"not say that the simulator made them; move them away, or give case {name!r} "
                "another source.folder"
            )
    print(f"simulating the recordings of {name} ...")  # noqa: T201
    _remove_listed(folder)
    case, simulators = config.cases[name], config.simulators
    recordings: Iterable[Recording]
    if case.source.maker == "robot-simulator":
        recordings = simulate_robot(simulators.robot, simulators.seed, case.channel_names)
    else:
        recordings = simulate_vessel(simulators.vessel, simulators.seed)
    written = write_recordings(folder, recordings, case.channel_names)
    recipe_path.write_text(json.dumps(recipes | {name: wanted}, indent=1) + "\n")
    print(f"  {len(written)} files")  # noqa: T201


def _remove_listed(folder: Path) -> None:
    """Remove recordings of an earlier make: those its index lists, and nothing else."""
    index = folder / "recordings.csv"
    if not index.exists():
        return
    for line in index.read_text(encoding="utf-8").splitlines()[1:]:
        (folder / f"{line.partition(',')[0]}.csv").unlink(missing_ok=True)


def _has_recordings(folder: Path) -> bool:
    return folder.is_dir() and any(folder.iterdir())


def _is_accepted(root: Path) -> bool:
    """Bring the recordings into DVC's cache and return True, if they are those of ``data.dvc``.

    Without a cache, as in a fresh clone, DVC's status can't tell whether recordings differ; its
    commit can, and refuses those that do.
    """
    if json.loads(run_dvc(root, "status", "data.dvc", "--json") or "{}") == {}:
        return True
    try:
        run_dvc(root, "commit", "data.dvc", "--quiet")
    except OdisarError:
        return False
    return True


def _findings(config: Config, root: Path) -> list[Finding]:
    return [
        finding
        for name in config.active_cases
        for finding in read_case(name, config.cases[name], root).findings
    ]


def _described(root: Path) -> str:
    files = [path for path in (root / "data").rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files)
    wanted = " ".join((root / "data.dvc").read_text(encoding="utf-8").split())
    return f"found {len(files)} files with {size} bytes, expected ({wanted})"
