"""A deployed capability: from a table of samples to the assessments that the pipeline makes."""

import json
from threading import Lock
from typing import Annotated, Self

import pandas as pd
import torch
from pydantic import Field, model_validator

from odisar.capability.assessment import (
    Assessment,
    Capability,
    Thresholds,
    assessment_schema,
    assessments_json,
)
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.scoring import Scorer
from odisar.config.base import PositiveFloat, PositiveInt, Section
from odisar.config.cases import Case
from odisar.deployment.manifest import Manifest
from odisar.deployment.samples import recordings_from_table
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin

#: Columns of the table of assessments, in the order of the schema.
ASSESSMENT_COLUMNS = tuple(assessment_schema()["required"])


class ThresholdValues(Section):
    """What calibration recordings allow; see ``capability.assessment.Thresholds``."""

    score: PositiveFloat
    reconstruction: PositiveFloat
    variance: PositiveFloat


class CapabilitySettings(Section):
    """How a twin's scores become assessments, and what calibration has set.

    ``innovation`` is the fitted score, ``thresholds`` decide the assessments. ``sigma`` and
    ``operating`` hold, by detector, the mu + k sigma threshold and the one that keeps the promised
    alarm rate. A window is reported every ``report_stride_steps``; ``max_rows`` samples are taken
    at once.
    """

    innovation: InnovationScoreValues
    thresholds: ThresholdValues
    threshold_sigmas: PositiveFloat
    sigma: dict[str, PositiveFloat]
    operating: dict[str, PositiveFloat]
    operating_pooled: bool
    calibration_hours: PositiveFloat
    attribution_top: PositiveInt
    report_stride_steps: PositiveInt
    scoring_batch: PositiveInt
    max_rows: PositiveInt


class Example(Section):
    """Samples of a calibration recording that are just enough for a window."""

    columns: Annotated[list[str], Field(min_length=1)]
    data: Annotated[list[list[float]], Field(min_length=1)]

    @model_validator(mode="after")
    def _check(self) -> Self:
        for i, row in enumerate(self.data):
            if len(row) != len(self.columns):
                raise ValueError(f"row {i} has {len(row)} values, not {len(self.columns)}")
        return self

    @property
    def table(self) -> pd.DataFrame:
        """The samples as a table."""
        return pd.DataFrame(self.data, columns=self.columns)


class Deployed:
    """A twin, its case and its calibrated capability, on the CPU with one thread."""

    def __init__(
        self,
        twin: TrainedTwin,
        case: Case,
        settings: CapabilitySettings,
        manifest: Manifest,
        example: Example,
    ) -> None:
        self.twin, self.case, self.settings, self.manifest = twin, case, settings, manifest
        self._example = example
        self._scorer = Scorer(twin, settings.scoring_batch, "cpu", settings.innovation.build())
        thresholds = Thresholds(**settings.thresholds.model_dump())
        self._capability = Capability(
            self._scorer, thresholds, attribution_top=settings.attribution_top
        )
        # Stored dropout masks are put into the network while it draws: one request at a time.
        self._lock = Lock()

    @property
    def example(self) -> pd.DataFrame:
        """A table that ``assess`` takes."""
        return self._example.table

    def assess(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return the assessment of every reported window in a table of samples.

        ``table`` is what ``samples.recordings_from_table`` takes. A row of the result is one
        assessment, a column one of its keys; ``state_attribution`` holds mappings.

        Raises
        ------
        OdisarError
            If the table cannot be assessed, saying which column, row and value and what to do.
        """
        recordings = recordings_from_table(
            table, self.manifest.origin.case, self.case, self.settings.max_rows
        )
        rows = [row for recording in recordings for row in self._assess(recording)]
        # By way of the checked JSON, so that whatever is returned fits the published schema.
        return pd.DataFrame(json.loads(assessments_json(rows)), columns=list(ASSESSMENT_COLUMNS))

    def _assess(self, recording: Recording) -> list[Assessment]:
        with self._lock:
            threads = torch.get_num_threads()
            torch.set_num_threads(1)
            try:
                scores = self._scorer.score(recording, short_lead_steps=self.case.short_lead_steps)
                return self._capability.assess(
                    recording,
                    scores,
                    stride_steps=self.settings.report_stride_steps,
                    step_s=1 / self.case.rate_hz,
                )
            finally:
                torch.set_num_threads(threads)
