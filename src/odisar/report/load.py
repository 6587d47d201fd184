"""Everything the report looks at, read from a workspace when it is first asked for."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from odisar.artifacts import Workspace, read_json, read_table
from odisar.config.cases import Case
from odisar.config.judging import Judging
from odisar.config.loader import PARAMS_FILE, ConfigView, load_config
from odisar.errors import OdisarError
from odisar.evaluation.cells import cell_name
from odisar.recordings.quality import read_quality_table
from odisar.report.detectors import ORACLE
from odisar.report.ordering import ordered_values

#: Sections of ``params.yaml`` that the report and its notebooks read.
SECTIONS = (
    "seed",
    "pipeline",
    "setups",
    "cases",
    "twin",
    "monte_carlo",
    "training",
    "tuning",
    "capability",
    "evaluation",
    "report",
    "simulators",
)
OVERALL = "overall"


def report_folder(root: Path) -> Path:
    """Return where the report stage keeps what is not committed."""
    return root / "build/report"


def study_folder(root: Path) -> Path:
    """Return where the full study puts its tables; the default run has none."""
    return root / "reports/study"


def find_root(start: Path) -> Path:
    """Return the nearest folder, from ``start`` upwards, that holds ``params.yaml``."""
    for folder in (start, *start.parents):
        if (folder / PARAMS_FILE).is_file():
            return folder
    raise OdisarError(f"no {PARAMS_FILE} in {start} or above it; open this inside the project")


def load_results(root: Path) -> "Results":
    """Return the results of the workspace ``root``."""
    return Results(Workspace(root), ConfigView(load_config(root), SECTIONS))


@dataclass(frozen=True)
class Examples:
    """What was taken from recordings and twins for the figures (see ``report.examples``).

    ``chosen`` names, by case, the disturbed and the clean example with their events;
    ``recordings`` has a row for each test recording of each set-up; ``traces`` (case, recording,
    time_s, channel, value) and ``forecasts`` are in physical units.
    """

    chosen: dict[str, dict[str, Any]]
    recordings: pd.DataFrame
    traces: pd.DataFrame
    forecasts: pd.DataFrame


def rows_of(table: pd.DataFrame) -> Iterator[Any]:
    """Yield the rows of a table as tuples with a field for each column."""
    yield from table.itertuples(index=False)


def read_test_recordings(path: Path) -> pd.DataFrame:
    """Read the list of test recordings; metadata stay text, as the result tables name them."""
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    table["strength"] = pd.to_numeric(table.strength)
    for column in ("is_overall", "is_disturbed"):
        table[column] = table[column] == "True"
    return table


class Results:
    """Tables and artefacts of one workspace; a missing one is an error when it is asked for."""

    def __init__(self, workspace: Workspace, config: ConfigView) -> None:
        self.workspace = workspace
        self.config = config

    @property
    def setups(self) -> list[str]:
        """Names of the judged set-ups."""
        return list(self.config.pipeline.setups)

    @property
    def cases(self) -> list[str]:
        """Names of the active cases."""
        return list(self.config.active_cases)

    def case_of(self, setup: str) -> Case:
        """Return a set-up's case."""
        case: Case = self.config.case_of(setup)
        return case

    def judging(self, setup: str) -> Judging:
        """Return how a set-up is judged."""
        return Judging.of(self.config.evaluation, self.case_of(setup))

    def setups_of(self, case: str) -> list[str]:
        """Return the set-ups of a case."""
        return [setup for setup in self.setups if self.config.setups[setup].case == case]

    @cached_property
    def detection(self) -> pd.DataFrame:
        """Detection and operating metrics with intervals (``detection.csv``)."""
        return self._result("detection")

    @cached_property
    def operating(self) -> pd.DataFrame:
        """Hours and events behind the operating metrics."""
        return self._result("operating")

    @cached_property
    def paired(self) -> pd.DataFrame:
        """What the monitor has over every other detector, with paired intervals."""
        return self._result("paired")

    @cached_property
    def rules(self) -> pd.DataFrame:
        """What every rule for a threshold promised and gave (``thresholds.csv``)."""
        return self._result("thresholds")

    @cached_property
    def quadrants(self) -> pd.DataFrame:
        """Shares of the four quadrants."""
        return self._result("quadrants")

    @cached_property
    def attribution(self) -> pd.DataFrame:
        """How often each state comes first, and among the first three."""
        return self._result("attribution")

    @cached_property
    def blame(self) -> pd.DataFrame:
        """How often the channel that a fault was put on is named."""
        return self._result("blame")

    @cached_property
    def reliability(self) -> pd.DataFrame:
        """Coverage, sharpness and CRPS of the predictive distributions."""
        return self._result("reliability")

    @cached_property
    def reliability_curves(self) -> pd.DataFrame:
        """How often truths lie below each quantile of the predictive distributions."""
        return self._result("reliability-curves")

    @cached_property
    def forecast(self) -> pd.DataFrame:
        """Errors of the twins' forecasts and of simpler forecasters, by state and step."""
        return self._result("forecast")

    @cached_property
    def leakage(self) -> pd.DataFrame:
        """What the leakage probes found about every detector of every twin."""
        return self._result("leakage")

    @cached_property
    def nearness(self) -> pd.DataFrame:
        """Distances of windows to their nearest training window."""
        return self._result("nearness")

    def study(self, name: str) -> pd.DataFrame | None:
        """Return a table of the study, or None where the study has not made it.

        Some parts of the study write a file for each set-up; these come below one another.
        """
        folder = study_folder(self.workspace.root)
        names = [name, *(f"{name}-{setup}" for setup in self.config.setups)]
        paths = [folder / f"{known}.csv" for known in names]
        parts = [read_table(path) for path in paths if path.is_file()]
        return pd.concat(parts, ignore_index=True) if parts else None

    def _result(self, name: str) -> pd.DataFrame:
        return read_table(self.workspace.results / f"{name}.csv")

    @cached_property
    def splits(self) -> pd.DataFrame:
        """Recordings, hours and windows of every split."""
        return read_table(self.workspace.preprocess / "splits.csv")

    @cached_property
    def quality(self) -> pd.DataFrame:
        """What the checks of every recording found."""
        return read_quality_table(self.workspace.preprocess / "quality.csv")

    @cached_property
    def training(self) -> dict[str, Any]:
        """History and number of windows of every member's training."""
        return read_json(self.workspace.train / "training.json")

    def tuning(self, setup: str) -> dict[str, dict[str, Any]]:
        """Return trials and tuned values of a set-up by member: every fold has its own study."""
        members: dict[str, dict[str, Any]] = read_json(self.workspace.tuned(setup))["members"]
        return members

    def limits(self, setup: str) -> dict[str, dict[str, Any]]:
        """Return thresholds and calibration facts by member."""
        members: dict[str, dict[str, Any]] = read_json(self.workspace.thresholds(setup))["members"]
        return members

    def assessments(self, setup: str) -> pd.DataFrame:
        """Return one row for each assessed window of the test recordings, with its member.

        ``score_ratio`` and ``variance_ratio`` are multiples of the member's thresholds,
        ``is_disturbed`` whether a disturbance was active when the window was assessed.
        """
        path = self.workspace.assessments(setup)
        table = pd.DataFrame(json.loads(path.read_text(encoding="utf-8")))
        known = self.examples.recordings
        known = known.loc[known.setup == setup, ["recording", "member", "is_overall", "events"]]
        table = table.merge(known, on="recording", how="left", validate="many_to_one")
        limits = self.limits(setup)
        thresholds = table.member.map(lambda name: limits[name]["thresholds"])
        table["score_ratio"] = table.score / thresholds.map(lambda given: given["score"])
        table["variance_ratio"] = table.uncertainty_variance / thresholds.map(
            lambda given: given["variance"]
        )
        table["is_disturbed"] = [
            any(start <= t < end for start, end in json.loads(events))
            for t, events in zip(table.issued_s, table.events, strict=True)
        ]
        return table

    def scores(self, setup: str) -> pd.DataFrame:
        """Return the scores of a set-up's test recordings by recording and time."""
        return pd.read_parquet(self.workspace.scores(setup))

    @cached_property
    def examples(self) -> Examples:
        """Example recordings and forecasts that the report stage prepared."""
        folder = report_folder(self.workspace.root) / "examples"
        return Examples(
            read_json(folder / "chosen.json"),
            read_test_recordings(folder / "recordings.csv"),
            pd.read_parquet(folder / "traces.parquet"),
            pd.read_parquet(folder / "forecasts.parquet"),
        )

    def detectors(self, setup: str) -> list[str]:
        """Return a set-up's detectors in the order of the table, without the oracle."""
        rows = self.detection[self.detection.setup == setup]
        return [name for name in rows.detector.unique() if name != ORACLE]

    def strengths(self, setup: str, evaluated_on: str = OVERALL) -> list[float]:
        """Return the strengths at which something was detected, weakest first.

        Never empty: NaN stands for recordings without a strength, and for no recordings at all.
        """
        rows = self.detection
        rows = rows[(rows.setup == setup) & (rows.evaluated_on == evaluated_on)]
        rows = rows[rows.metric == "auroc"]
        found = sorted(rows.strength.unique(), key=lambda value: (pd.notna(value), value))
        return found or [float("nan")]

    def scenarios(self, setup: str) -> pd.DataFrame:
        """Return what a set-up was judged on: ``evaluated_on``, ``group`` and ``is_apart``.

        ``group`` is the metadata column whose value the scenario is, in the case's order, the first
        where columns share it; what is judged apart comes last.
        """
        groups = self.case_of(setup).groups
        known = self.examples.recordings
        known = known[known.setup == setup]
        judged = list(self.quadrants[self.quadrants.setup == setup].evaluated_on.unique())
        rows = [{"evaluated_on": OVERALL, "group": OVERALL, "is_apart": False}]
        for column in dict.fromkeys([*groups.group_by, *groups.apart]):
            rows += [
                {
                    "evaluated_on": name,
                    "group": column,
                    "is_apart": column in groups.apart
                    and value not in groups.overall.get(column, []),
                }
                for value in ordered_values(known, column)
                for name in (value, cell_name(column, value))
                if name in judged and name != OVERALL
            ]
        scenarios = pd.DataFrame(rows).drop_duplicates("evaluated_on")
        return scenarios.sort_values("is_apart", kind="stable", ignore_index=True)
