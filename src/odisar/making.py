"""Make the recordings of a workspace and hold them against ``data.dvc``."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

from odisar.config.loader import Config, load_config
from odisar.errors import OdisarError
from odisar.recordings.quality import Finding, raise_on_errors
from odisar.recordings.reader import read_case
from odisar.recordings.writer import write_recordings
from odisar.simulators.vessel.runs import simulate_vessel
from odisar.sources.gunnerus import make_gunnerus

#: Says what simulated recordings were made from, so that changed parameters make them anew.
_STAMPS = "build/recordings-made-from.json"


def make_recordings(root: Path) -> None:
    """Make what the active cases lack; recordings that are there are left as they are.

    A simulated case is made again when its simulator's parameters or the seed have changed since.
    Raises OdisarError for a case that has neither recordings nor a way to make them.
    """
    config = load_config(root)
    stamps_path = root / _STAMPS
    stamps = json.loads(stamps_path.read_text()) if stamps_path.exists() else {}
    for name in config.active_cases:
        folder = root / config.cases[name].source.folder
        recipe = _recipe(config, name)
        if _has_recordings(folder) and stamps.get(name, recipe) == recipe:
            continue
        _make_case(config, name, root, folder)
        stamps[name] = recipe
        stamps_path.parent.mkdir(parents=True, exist_ok=True)
        stamps_path.write_text(json.dumps(stamps, indent=1) + "\n")


def track_recordings(root: Path, *, accept: bool) -> None:
    """Bring the recordings into DVC's cache if they are those of ``data.dvc``.

    Raises OdisarError where they differ (unless ``accept``): with the bad files if there are any,
    else with the way to accept the difference.
    """
    if not (root / "data.dvc").exists():
        run_dvc(root, "add", "data", "--quiet")
        return
    status = json.loads(run_dvc(root, "status", "data.dvc", "--json") or "{}")
    if not _differs(status):
        run_dvc(root, "commit", "data.dvc", "--quiet")
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
        words = (done.stderr or done.stdout).strip()
        raise OdisarError(f"dvc {' '.join(arguments)} failed: {words}")
    return done.stdout.strip()


def _make_case(config: Config, name: str, root: Path, folder: Path) -> None:
    case = config.cases[name]
    if name == "vessel":
        print(f"simulating the recordings of {name} into {case.source.folder} ...")  # noqa: T201
        _remove_listed(folder)
        recordings = simulate_vessel(config.simulators.vessel, config.seed)
        written = write_recordings(folder, recordings, case.channel_names)
        print(f"  {len(written)} files")  # noqa: T201
    elif name == "gunnerus":
        make_gunnerus(config.sources.gunnerus, root, folder)
    else:
        raise OdisarError(
            f"case {name!r}: there are no recordings in {case.source.folder}; put its CSV files "
            "there (see the README, 'Your own recordings')"
        )


def _remove_listed(folder: Path) -> None:
    """Remove recordings of an earlier make: those its index lists, and nothing else."""
    index = folder / "recordings.csv"
    if not index.exists():
        return
    for line in index.read_text(encoding="utf-8").splitlines()[1:]:
        (folder / f"{line.partition(',')[0]}.csv").unlink(missing_ok=True)


def _recipe(config: Config, name: str) -> str:
    if name != "vessel":
        return "recorded"
    text = f"{config.seed} {config.simulators.vessel.model_dump_json()}"
    return hashlib.sha256(text.encode()).hexdigest()


def _has_recordings(folder: Path) -> bool:
    return folder.is_dir() and any(folder.iterdir())


def _differs(status: dict[str, object]) -> bool:
    return "modified" in json.dumps(status) or "deleted" in json.dumps(status)


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
