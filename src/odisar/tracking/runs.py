"""Runs: one parent run for a configuration, one nested run for a stage.

The parent is found by a *content key*, a hash of everything that decides results (parameters,
pipeline, recordings, source code). Stages run in processes of their own; each finds or makes the
parent, so that cached and repeated stages neither lose nor double a run.
"""

import hashlib
import json
import os
import re
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mlflow
from mlflow.entities import (
    Dataset,
    DatasetInput,
    InputTag,
    Metric,
    Param,
    Run,
    RunStatus,
    RunTag,
)
from mlflow.tracking import MlflowClient

from odisar.config.loader import PARAMS_FILE, read_yaml
from odisar.tracking.story import EXPERIMENT_NOTE, UNTOLD, Story

#: Names another folder than the workspace as the home of the MLflow store.
ROOT_VARIABLE = "ODISAR_TRACKING_ROOT"
#: Set on the parent run by the last step, with the key of what was published.
PUBLISHED_TAG = "odisar.published"
#: Status of a run that came to its end.
FINISHED = RunStatus.to_string(RunStatus.FINISHED)
_CONTENT_TAG, _STAGE_TAG, _PARENT_TAG = "odisar.content", "DVC_STAGE", "mlflow.parentRunId"
_NAME_TAG, _NOTE_TAG = "mlflow.runName", "mlflow.note.content"
# The kind decides which pages the UI offers: those for training, not those for language models.
_EXPERIMENT_TAGS = {
    _NOTE_TAG: EXPERIMENT_NOTE,
    "mlflow.experimentKind": "custom_model_development",
}
#: DVC runs queued experiments in a temporary copy below the repository.
_QUEUE_FOLDER = ".dvc/tmp/exps"
#: MLflow refuses longer values of a parameter.
_PARAM_LIMIT = 6000


def tracking_root(root: Path) -> Path:
    """Return the folder of the MLflow store: the repository's, for its temporary copies too."""
    named = os.environ.get(ROOT_VARIABLE)
    if named:
        return Path(named)
    head, queued, _ = str(root.resolve()).partition(f"/{_QUEUE_FOLDER}/")
    return Path(head) if queued else root.resolve()


def tracking_uri(root: Path) -> str:
    """Return the address of the SQLite store."""
    return f"sqlite:///{tracking_root(root) / 'mlflow.db'}"


def content_key(root: Path) -> str:
    """Return the hash of everything that decides this workspace's results.

    Of ``params.yaml`` its values, not its words, and no profile: those are for other workspaces.
    """
    digest = hashlib.sha256()
    if (root / PARAMS_FILE).exists():
        params = read_yaml(root / PARAMS_FILE)
        params.pop("profiles", None)
        digest.update(json.dumps(params, default=str).encode())
    named = [root / "dvc.yaml", root / "data.dvc"]
    for path in [*named, *sorted((root / "src").rglob("*.py"))]:
        if path.exists():
            digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


@dataclass(frozen=True)
class TrackedRun:
    """One MLflow run: where a stage logs what it did."""

    client: MlflowClient
    run_id: str

    def params(self, values: Mapping[str, Any]) -> None:
        """Log parameters; nested mappings get dotted names."""
        flat = [Param(_safe(k), str(v)[:_PARAM_LIMIT]) for k, v in flatten(values).items()]
        for start in range(0, len(flat), 100):
            self.client.log_batch(self.run_id, params=flat[start : start + 100])

    def metrics(self, values: Mapping[str, Any], step: int = 0) -> None:
        """Log numbers, at an epoch where there is one; nested mappings get dotted names."""
        started = self.client.get_run(self.run_id).info.start_time
        flat = {_safe(k): float(v) for k, v in flatten(values).items()}
        batch = [Metric(k, v, started + step, step) for k, v in flat.items()]
        for start in range(0, len(batch), 1000):
            self.client.log_batch(self.run_id, metrics=batch[start : start + 1000])

    def tags(self, values: Mapping[str, str]) -> None:
        """Set tags."""
        self.client.log_batch(self.run_id, tags=[RunTag(k, v) for k, v in values.items()])

    def note(self, text: str) -> None:
        """Set the run's description, in Markdown."""
        self.tags({_NOTE_TAG: text})

    def dataset(self, name: str, digest: str, source: str, profile: Mapping[str, Any]) -> None:
        """Log which recordings were used; the same ones twice are logged once."""
        dataset = Dataset(
            name, digest, "local", json.dumps({"uri": source}), profile=json.dumps(profile)
        )
        use = InputTag("mlflow.data.context", "pipeline")
        self.client.log_inputs(self.run_id, [DatasetInput(dataset, [use])])

    def artifact(self, path: Path, folder: str | None = None) -> None:
        """Copy a file, or all of a folder, into the run."""
        if path.is_dir():
            self.client.log_artifacts(self.run_id, str(path), folder)
        else:
            self.client.log_artifact(self.run_id, str(path), folder)

    @contextmanager
    def child(self, name: str, tags: Mapping[str, str]) -> Iterator["TrackedRun"]:
        """Open a nested run, of an Optuna trial for instance."""
        experiment = self.client.get_run(self.run_id).info.experiment_id
        yield from _finished(self.client, _start(self.client, experiment, name, self.run_id, tags))


class Tracker:
    """The MLflow store of a workspace, and the parent run of what the workspace holds now."""

    def __init__(self, root: Path, experiment: str, story: Story = UNTOLD) -> None:
        self._root = root
        self.story = story
        mlflow.set_tracking_uri(tracking_uri(root))
        self.client = MlflowClient(tracking_uri(root))
        found = self.client.get_experiment_by_name(experiment)
        if found is None:
            artifacts = (tracking_root(root) / "mlartifacts").as_uri()
            self._experiment = self.client.create_experiment(
                experiment, artifacts, tags=_EXPERIMENT_TAGS
            )
        else:
            self._experiment = found.experiment_id
            for name, value in _EXPERIMENT_TAGS.items():
                if name not in found.tags:  # made by hand, or by an earlier version
                    self.client.set_experiment_tag(self._experiment, name, value)

    def find_parent(self) -> Run | None:
        """Return the parent run of this content, if there is one."""
        return self._find({_CONTENT_TAG: content_key(self._root)}, parent=None)

    def parent(self) -> TrackedRun:
        """Find or make the parent run of this content."""
        found = self.find_parent()
        if found is not None:
            return TrackedRun(self.client, found.info.run_id)
        key = content_key(self._root)
        tags = {
            _CONTENT_TAG: key,
            "git.revision": git_revision(self._root),
            "data.hash": data_hash(self._root),
            _NOTE_TAG: self.story.note,
            **self.story.tags,
        }
        name = f"{self.story.title} ({key[:8]})"
        return TrackedRun(self.client, _start(self.client, self._experiment, name, None, tags))

    @contextmanager
    def stage(self, name: str) -> Iterator[TrackedRun]:
        """Open the nested run of a stage, in place of an earlier run of the same stage.

        A stage that fails marks its own run and the parent as failed.
        """
        parent = self.parent()
        parent.tags({PUBLISHED_TAG: ""})
        self._drop({_STAGE_TAG: name}, parent.run_id)
        self.client.update_run(parent.run_id, RunStatus.to_string(RunStatus.RUNNING))
        tags = {_STAGE_TAG: name, _NOTE_TAG: self.story.stages.get(name, "")}
        run_id = _start(self.client, self._experiment, name, parent.run_id, tags)
        try:
            yield from _finished(self.client, run_id)
        except BaseException:
            self.client.set_terminated(parent.run_id, RunStatus.to_string(RunStatus.FAILED))
            raise

    def finish(self) -> None:
        """Mark the parent as finished."""
        self.client.set_terminated(self.parent().run_id, FINISHED)

    def stage_seconds(self) -> dict[str, float]:
        """Return how long each stage of this content took, by the stage's name."""
        parent = self.find_parent()
        if parent is None:
            return {}
        runs = self._children(parent.info.run_id)
        return {
            run.data.tags[_STAGE_TAG]: (run.info.end_time - run.info.start_time) / 1000
            for run in sorted(runs, key=lambda run: run.info.start_time)
            if _STAGE_TAG in run.data.tags and run.info.end_time
        }

    def _children(self, parent_id: str) -> Sequence[Run]:
        query = f"tags.`{_PARENT_TAG}` = '{parent_id}'"
        runs: Sequence[Run] = self.client.search_runs([self._experiment], query, max_results=1000)
        return runs

    def _find(self, tags: Mapping[str, str], parent: str | None) -> Run | None:
        wanted = dict(tags) | ({_PARENT_TAG: parent} if parent else {})
        query = " and ".join(f"tags.`{key}` = '{value}'" for key, value in wanted.items())
        runs = self.client.search_runs([self._experiment], query, max_results=1)
        return runs[0] if runs else None

    def _drop(self, tags: Mapping[str, str], parent_id: str) -> None:
        while (old := self._find(tags, parent_id)) is not None:
            for trial in self._children(old.info.run_id):
                self.client.delete_run(trial.info.run_id)
            self.client.delete_run(old.info.run_id)


def initialise_store(root: Path) -> None:
    """Create the database once, before two processes could try it at the same time."""
    MlflowClient(tracking_uri(root)).search_experiments(max_results=1)


def git_revision(root: Path) -> str:
    """Return the commit, with ``-dirty`` where tracked files differ; ``unknown`` outside git."""
    described = _git(root, "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")
    return described or "unknown"


def data_hash(root: Path) -> str:
    """Return the hash of the recordings as DVC tracks them."""
    path = root / "data.dvc"
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16] if path.exists() else "untracked"


def flatten(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return a mapping with dotted names instead of nested mappings."""
    flat: dict[str, Any] = {}
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            flat |= flatten(value, f"{name}.")
        else:
            flat[name] = value
    return flat


def _safe(name: str) -> str:
    """Return a name that MLflow takes: a channel may be called ``v [m/s]``."""
    return re.sub(r"[^A-Za-z0-9_. -]", "_", name)


def _start(
    client: MlflowClient,
    experiment: str,
    name: str,
    parent_id: str | None,
    tags: Mapping[str, str],
) -> str:
    wanted = {_NAME_TAG: name, **tags} | ({_PARENT_TAG: parent_id} if parent_id else {})
    run_id: str = client.create_run(experiment, tags=wanted, run_name=name).info.run_id
    return run_id


def _finished(client: MlflowClient, run_id: str) -> Iterator[TrackedRun]:
    try:
        yield TrackedRun(client, run_id)
    except BaseException:
        client.set_terminated(run_id, RunStatus.to_string(RunStatus.FAILED))
        raise
    client.set_terminated(run_id, FINISHED)


def _git(root: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(
            ["git", *arguments], cwd=root, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return ""
    return done.stdout.strip()
