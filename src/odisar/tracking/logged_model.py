"""A bundle as an MLflow model: models from code, with the code it needs, and without pickle."""

import hashlib
import logging
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mlflow
from mlflow.exceptions import MlflowException
from mlflow.models import Model, ModelSignature
from mlflow.tracking import MlflowClient
from mlflow.types import ColSpec, DataType, Schema
from mlflow.types.schema import Map

import odisar
from odisar.deployment.deployed import ASSESSMENT_COLUMNS, Deployed
from odisar.errors import OdisarError
from odisar.tracking.description import describe_input, pip_requirements
from odisar.tracking.runs import TrackedRun

#: Where MLflow puts the bundle in a model, and a file it adds to a download.
_BUNDLE, _ADDED = "artifacts", "registered_model_meta"
_SERVED = Path(__file__).with_name("served_model.py")


def log_bundle(
    client: MlflowClient, run: TrackedRun, bundle: Path, deployed: Deployed
) -> tuple[str, str]:
    """Log the model into a run; return its address and id."""
    # `mlflow.pyfunc.log_model` would need an active run, and end it.
    mlflow.set_experiment(experiment_id=client.get_run(run.run_id).info.experiment_id)
    with _quietly(), without_byte_code():
        info = Model.log(
            artifact_path=None,
            name=deployed.manifest.origin.setup,
            flavor=mlflow.pyfunc,
            run_id=run.run_id,
            python_model=str(_SERVED),
            artifacts={"bundle": str(bundle)},
            code_paths=[str(Path(odisar.__file__).parent)],
            signature=_signature(),
            input_example=deployed.example,
            pip_requirements=pip_requirements(),
            metadata={"odisar.inputs": describe_input(deployed)},
        )
    return info.model_uri, info.model_id


def _signature() -> ModelSignature:
    """Return the outputs alone.

    With inputs in it, MLflow would drop surplus columns (a misspelt one too), refuse columns of
    whole numbers, take text for numbers, and answer a wrong CSV cell with a traceback. Without, a
    table comes as it was sent and ``deployment.samples`` answers. The inputs are in the metadata.
    """
    types: dict[str, Any] = dict.fromkeys(ASSESSMENT_COLUMNS, DataType.double)
    types |= dict.fromkeys(("sequence_index", "start_time_step", "end_time_step"), DataType.long)
    flags = ("is_OOD", "recon_exceeds_threshold", "uncertainty_exceeds_threshold")
    types |= dict.fromkeys(flags, DataType.boolean)
    types |= dict.fromkeys(("recording", "category"), DataType.string)
    types["state_attribution"] = Map(DataType.double)
    return ModelSignature(outputs=Schema([ColSpec(t, name) for name, t in types.items()]))


def prove(folder: Path, deployed: Deployed) -> None:
    """Raise where the logged model, loaded anew, does not say what the bundle says."""
    path = list(sys.path)
    try:
        with without_byte_code():
            said = mlflow.pyfunc.load_model(str(folder)).predict(deployed.example)
    finally:
        sys.path[:] = path
    if not said.equals(deployed.assess(deployed.example)):
        raise OdisarError(
            f"{folder}: the logged model assesses its example otherwise than the bundle does; "
            "nothing was registered. Look for odisar code that changed meanwhile, and run again"
        )


def download(uri: str, folder: Path) -> None:
    """Copy a model's files into an empty folder, without byte code."""
    with _quietly():
        try:
            mlflow.artifacts.download_artifacts(artifact_uri=uri, dst_path=str(folder))
        except (MlflowException, OSError) as error:
            raise OdisarError(f"{uri}: the model's files cannot be fetched: {error}") from error
    # Byte code of an earlier load in the store: not registered, and Python would run it.
    for cache in list(folder.rglob("__pycache__")):
        if cache.is_dir() and not cache.is_symlink():
            shutil.rmtree(cache)
        else:
            cache.unlink(missing_ok=True)


def bundle_folder(folder: Path) -> Path:
    """Return the bundle in a downloaded model; raise OdisarError where there is none."""
    found = sorted((folder / _BUNDLE).glob("*/manifest.json"))
    if len(found) != 1:
        raise OdisarError(f"{folder}: the model holds no bundle; register it again")
    return found[0].parent


def model_hash(folder: Path) -> str:
    """Return a hash of every file of a model: the bundle, the code, and what MLflow adds."""
    digest = hashlib.sha256()
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*")}
    for name in sorted(files):
        if files[name].is_file() and name != _ADDED:
            digest.update(name.encode() + b"\0")
            digest.update(hashlib.sha256(files[name].read_bytes()).digest())
    return digest.hexdigest()


@contextmanager
def without_byte_code() -> Iterator[None]:
    """Import without leaving byte code: a model's folder holds what was registered, no more."""
    before = sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        sys.dont_write_bytecode = before


@contextmanager
def _quietly() -> Iterator[None]:
    logger = logging.getLogger("mlflow")
    level = logger.level
    logger.setLevel(logging.WARNING)
    variable = "MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR"
    before = os.environ.get(variable)
    os.environ[variable] = "false"
    try:
        yield
    finally:
        logger.setLevel(level)
        if before is None:
            del os.environ[variable]
        else:
            os.environ[variable] = before
