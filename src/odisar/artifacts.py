"""Every path of the pipeline, and typed reading and writing of what lies there."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from odisar.errors import OdisarError

#: Decimals of the committed tables: more than an interval can support, few enough to read.
_TABLE_DECIMALS = 6


@dataclass(frozen=True)
class Workspace:
    """A folder that holds ``params.yaml``, ``dvc.yaml``, ``data/``, and what the stages make."""

    root: Path

    @property
    def preprocess(self) -> Path:
        """Checked recordings, quality report, splits."""
        return self.root / "build/preprocess"

    @property
    def tune(self) -> Path:
        """Tuned values and trials."""
        return self.root / "build/tune"

    @property
    def train(self) -> Path:
        """Trained twins."""
        return self.root / "build/train"

    @property
    def calibrate(self) -> Path:
        """Thresholds and calibration scores."""
        return self.root / "build/calibrate"

    @property
    def evaluate(self) -> Path:
        """Scores and assessments of the test recordings."""
        return self.root / "build/evaluate"

    @property
    def development(self) -> Path:
        """How well the bundled twins do on development recordings."""
        return self.root / "build/bundle/development.json"

    @property
    def scratch(self) -> Path:
        """Checkpoints and studies of unfinished stages: what a killed stage goes on from."""
        return self.root / "build/scratch"

    @property
    def results(self) -> Path:
        """Result tables, committed."""
        return self.root / "reports/results"

    @property
    def figures(self) -> Path:
        """Figures, committed."""
        return self.root / "reports/figures"

    @property
    def metrics(self) -> Path:
        """Headline numbers for ``dvc metrics``, committed."""
        return self.root / "reports/metrics.json"

    @property
    def report(self) -> Path:
        """The one-file report."""
        return self.root / "reports/report.html"

    def distribution(self, setup: str) -> Path:
        """Return what calibration found of a set-up's predictive distributions."""
        return self.calibrate / f"{setup}.distribution.json"

    @property
    def study(self) -> Path:
        """What the study has trained and scored."""
        return self.root / "build/study"

    @property
    def study_results(self) -> Path:
        """Result tables of the study, committed."""
        return self.root / "reports/study"

    def recordings(self, case: str) -> Path:
        """Return the store of a case's checked recordings."""
        return self.preprocess / case

    def tuned(self, setup: str) -> Path:
        """Return a set-up's tuned values."""
        return self.tune / f"{setup}.json"

    def twin(self, member: str) -> Path:
        """Return a member's trained twin."""
        return self.train / member

    def thresholds(self, setup: str) -> Path:
        """Return a set-up's thresholds."""
        return self.calibrate / f"{setup}.json"

    def bundle(self, setup: str) -> Path:
        """Return a set-up's bundle: what is registered and can be deployed."""
        return self.root / "build/bundle" / setup

    def scores(self, setup: str) -> Path:
        """Return the scores of a set-up's test recordings."""
        return self.evaluate / f"{setup}.scores.parquet"

    def assessments(self, setup: str) -> Path:
        """Return a set-up's assessments, the paper's JSON."""
        return self.evaluate / f"{setup}.assessments.json"


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a mapping as sorted, indented JSON; NaN and infinity are refused."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(content, indent=2, sort_keys=True, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON mapping; raise OdisarError where an earlier stage has not written it."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise OdisarError(f"{path}: cannot be read ({error}); run `dvc repro`") from error
    if not isinstance(content, dict):
        raise OdisarError(f"{path}: expected a JSON object")
    return content


def write_table(path: Path, table: pd.DataFrame) -> None:
    r"""Write a CSV with ``\n`` line ends and six decimals; missing values stay empty."""
    path.parent.mkdir(parents=True, exist_ok=True)
    table.round(_TABLE_DECIMALS).to_csv(path, index=False, lineterminator="\n")


def read_table(path: Path) -> pd.DataFrame:
    """Read a CSV; raise OdisarError where an earlier stage has not written it."""
    try:
        return pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise OdisarError(f"{path}: cannot be read ({error}); run `dvc repro`") from error
