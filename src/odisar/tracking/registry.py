"""The MLflow registry: bundles as models that load without pickle, checked against their tags."""

import atexit
import fcntl
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import mlflow
from mlflow.entities.model_registry import ModelVersion
from mlflow.exceptions import MlflowException
from mlflow.tracking import MlflowClient

from odisar.config.registry import ChampionRule
from odisar.deployment.bundle import read_bundle
from odisar.deployment.deployed import Deployed
from odisar.deployment.development import DevelopmentScore
from odisar.deployment.manifest import manifest_hash
from odisar.errors import OdisarError
from odisar.tracking.champion import CHAMPION, Decision, Standing, decide
from odisar.tracking.description import describe_version
from odisar.tracking.logged_model import (
    bundle_folder,
    download,
    log_bundle,
    model_hash,
    prove,
    without_byte_code,
)
from odisar.tracking.runs import (
    TrackedRun,
    content_key,
    data_hash,
    git_revision,
    tracking_root,
    tracking_uri,
)

CONTENT_TAG, MANIFEST_TAG, MODEL_TAG = "odisar.content", "odisar.manifest_sha256", "odisar.sha256"
DECISION_TAG = "odisar.decision"
_SCORE_TAG = "odisar.development"

Rescore = Callable[[Deployed], DevelopmentScore]


@dataclass(frozen=True)
class Registration:
    """A version of a registered model, and what was decided about the champion."""

    model: str
    version: str
    decision: str
    is_champion: bool
    is_new: bool

    @property
    def line(self) -> str:
        """What came out, in one line."""
        alias = f"@{CHAMPION}" if self.is_champion else ""
        again = "" if self.is_new else " (already registered)"
        return f"model {self.model} version {self.version}{alias}{again}: {self.decision}"


def register(
    root: Path,
    run: TrackedRun,
    bundle: Path,
    score: DevelopmentScore,
    rule: ChampionRule,
    rescore: Rescore,
) -> Registration:
    """Register a bundle as a version of its model, once for the content of the workspace.

    The model is called ``<experiment>.<set-up>``. A new version is loaded and asked before it is
    registered. ``rescore`` measures an earlier champion on today's development recordings; it is
    called where the champion was measured on others, and may raise OdisarError. Of several
    processes that register at once, one waits for the other.
    """
    deployed = read_bundle(bundle)
    with _one_at_a_time(root):
        return _register(root, run, bundle, deployed, score, rule, rescore)


def _register(
    root: Path,
    run: TrackedRun,
    bundle: Path,
    deployed: Deployed,
    score: DevelopmentScore,
    rule: ChampionRule,
    rescore: Rescore,
) -> Registration:
    mlflow.set_tracking_uri(tracking_uri(root))
    client = MlflowClient(tracking_uri(root))
    name = model_name(_experiment(client, run), deployed.manifest.origin.setup)
    version = _find_version(client, name, content_key(root))
    is_new = version is None
    if version is None:
        version = _create_version(client, root, run, bundle, (name, deployed, score))
    decision = version.tags.get(DECISION_TAG)
    if decision is None:
        found = _decide(client, name, str(version.version), score, rule, rescore)
        if found.moves:
            client.set_registered_model_alias(name, CHAMPION, version.version)
        decision = found.sentence
        text = describe_version(deployed, name, str(version.version), score, decision)
        client.update_model_version(name, version.version, text)
        client.set_model_version_tag(name, version.version, DECISION_TAG, decision)
    champion = _champion(client, name)
    is_champion = champion is not None and str(champion.version) == str(version.version)
    return Registration(name, str(version.version), decision, is_champion, is_new)


def load_model(root: Path, name: str, alias_or_version: str) -> Any:
    """Return a registered model, checked against the registry's tags before any of it is run.

    The result is MLflow's ``PyFuncModel``: ``predict`` takes a table of samples and returns
    assessments. Raises OdisarError where there is no such model or version, where a file of the
    model is not the one that was registered, or where the bundle cannot be read.
    """
    client = _open_store(root)
    version = _version(client, name, alias_or_version)
    folder = Path(tempfile.mkdtemp(prefix="odisar-model-"))
    # The model imports from its folder for as long as the process runs.
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    _fetch(version, folder)
    with without_byte_code():
        return mlflow.pyfunc.load_model(str(folder))


def promote(root: Path, name: str, version_number: str) -> str:
    """Move the alias ``champion`` by hand; return what was done in one sentence."""
    client = _open_store(root)
    version = _version(client, name, version_number)
    before = _champion(client, name)
    was = "there was none" if before is None else f"it was version {before.version}"
    sentence = f"version {version.version} became the champion by hand; {was}"
    client.set_registered_model_alias(name, CHAMPION, version.version)
    client.set_model_version_tag(name, version.version, DECISION_TAG, sentence)
    return f"model {name}: {sentence}"


def model_name(experiment: str, setup: str) -> str:
    """Return what the detector of an experiment's set-up is called in the registry."""
    return f"{re.sub(r'[^A-Za-z0-9_-]', '-', experiment)}.{setup}"


def _experiment(client: MlflowClient, run: TrackedRun) -> str:
    name: str = client.get_experiment(client.get_run(run.run_id).info.experiment_id).name
    return name


def _open_store(root: Path) -> MlflowClient:
    """Return the store at ``root`` or above it; a workspace's models are in the project's.

    Raises OdisarError where there is none: asking for a model must not make an empty one.
    """
    start = tracking_root(root)
    for folder in (start, *start.parents):
        if (folder / "mlflow.db").is_file():
            mlflow.set_tracking_uri(tracking_uri(folder))
            return MlflowClient(tracking_uri(folder))
    raise OdisarError(
        f"{start}: no MLflow store (mlflow.db) here or above; run this in the project's root, "
        "after `make repro` or `odisar profile NAME`"
    )


def _find_version(client: MlflowClient, name: str, content: str) -> ModelVersion | None:
    found = client.search_model_versions(f"tags.`{CONTENT_TAG}`='{content}'")
    return next((version for version in found if version.name == name), None)


def _create_version(
    client: MlflowClient,
    root: Path,
    run: TrackedRun,
    bundle: Path,
    about: tuple[str, Deployed, DevelopmentScore],
) -> ModelVersion:
    name, deployed, score = about
    uri, model_id = log_bundle(client, run, bundle, deployed)
    with tempfile.TemporaryDirectory(prefix="odisar-model-") as temporary:
        folder = Path(temporary)
        download(uri, folder)
        digest = model_hash(folder)
        prove(folder, deployed)
    origin = deployed.manifest.origin
    tags = {
        CONTENT_TAG: content_key(root),
        MANIFEST_TAG: manifest_hash(bundle),
        MODEL_TAG: digest,
        "odisar.setup": origin.setup,
        "odisar.case": origin.case,
        "odisar.member": origin.member,
        "data.hash": data_hash(root),
        "git.revision": git_revision(root),
        **{f"{_SCORE_TAG}.{k}": str(v) for k, v in asdict(score).items() if v is not None},
    }
    try:
        client.create_registered_model(name, description=f"ODiSAR on: {deployed.case.title}")
    except MlflowException:
        client.get_registered_model(name)  # it is there already, or this says what is wrong
    return client.create_model_version(name, uri, run.run_id, tags=tags, model_id=model_id)


def _decide(
    client: MlflowClient,
    name: str,
    number: str,
    score: DevelopmentScore,
    rule: ChampionRule,
    rescore: Rescore,
) -> Decision:
    challenger = Standing(number, score.auroc, "there are no disturbed development recordings")
    version = _champion(client, name)
    if version is None:
        return decide(name, challenger, None, rule)
    if str(version.version) == number:
        return Decision(moves=False, sentence=f"version {number} became the champion")
    return decide(name, challenger, _standing(version, score, rescore), rule)


def _standing(version: ModelVersion, score: DevelopmentScore, rescore: Rescore) -> Standing:
    """Return what a champion reached on the recordings of ``score``, measured again if need be."""
    number = str(version.version)
    tags = version.tags
    if tags.get(f"{_SCORE_TAG}.measured_on") == score.measured_on:
        auroc = tags.get(f"{_SCORE_TAG}.auroc")
        return Standing(number, None if auroc is None else float(auroc), "it was not measured")
    if score.auroc is None:
        return Standing(number, None, "there are no disturbed development recordings")
    try:
        with tempfile.TemporaryDirectory(prefix="odisar-model-") as folder:
            _fetch(version, Path(folder))
            measured = rescore(read_bundle(bundle_folder(Path(folder))))
    except OdisarError as error:
        return Standing(number, None, str(error))
    if measured.measured_on != score.measured_on:
        return Standing(number, None, "it scores other samples (context, horizon or score differ)")
    return Standing(number, measured.auroc, "it cannot be measured on today's recordings")


def _version(client: MlflowClient, name: str, alias_or_version: str) -> ModelVersion:
    try:
        if alias_or_version.isdigit():
            return client.get_model_version(name, alias_or_version)
        return client.get_model_version_by_alias(name, alias_or_version)
    except MlflowException as error:
        models = ", ".join(m.name for m in client.search_registered_models()) or "none"
        versions = client.search_model_versions()  # a name with a quote in it is no filter
        numbers = ", ".join(str(v.version) for v in versions if v.name == name)
        raise OdisarError(
            f"there is no version or alias {alias_or_version!r} of model {name!r}; registered "
            f"models: {models}; versions of this one: {numbers or 'none'}"
        ) from error


@contextmanager
def _one_at_a_time(root: Path) -> Iterator[None]:
    """Hold the lock of the store: finding a version and making it is no single step in MLflow."""
    store = tracking_root(root) / "mlartifacts"
    store.mkdir(parents=True, exist_ok=True)
    with (store / "registering.lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # until the file is closed
        yield


def _champion(client: MlflowClient, name: str) -> ModelVersion | None:
    try:
        return client.get_model_version_by_alias(name, CHAMPION)
    except MlflowException:
        return None


def _fetch(version: ModelVersion, folder: Path) -> None:
    """Download a version into an empty folder and hold it against the version's tags."""
    download(f"models:/{version.name}/{version.version}", folder)
    found = {MANIFEST_TAG: manifest_hash(bundle_folder(folder)), MODEL_TAG: model_hash(folder)}
    for tag, value in found.items():
        if version.tags.get(tag) != value:
            what = "bundle's manifest" if tag == MANIFEST_TAG else "model's files"
            raise OdisarError(
                f"model {version.name} version {version.version}: the {what} are not what was "
                f"registered (tag {tag}); do not use it. Register it again (odisar stage publish "
                "after a change) or restore the artefact store"
            )
