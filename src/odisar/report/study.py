"""What the full study adds, where it has been run: its tables, and a sentence for what is missing.

The default run leaves the study out for its time, so each part of the report that needs it is made
only where its table exists.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from odisar.report.detectors import MONITOR, detector_name
from odisar.report.headline import headline_table
from odisar.report.load import OVERALL, Results
from odisar.report.picking import at_strength, same_strength
from odisar.report.tables import Table, frame_table, number

#: Rows of a table that are printed; the file has all.
_ROWS = 150


@dataclass(frozen=True)
class StudyTable:
    """A table of the study: what it says, and which of its rows are printed, by column."""

    name: str
    title: str
    note: str = ""
    only: tuple[tuple[str, object], ...] = ()


STUDY_TABLES = (
    StudyTable("detection", "every detector under P2"),
    StudyTable(
        "paired",
        "ODiSAR minus every other detector",
        "Paired bootstrap, as fractions and seconds; P2, overall.",
        (("evaluated_on", OVERALL), ("protocol", "P2")),
    ),
    StudyTable(
        "seeds",
        "spread over training seeds",
        "How far values lie apart from training to training; P2, overall.",
        (("evaluated_on", OVERALL), ("protocol", "P2")),
    ),
    StudyTable(
        "vus",
        "range-aware detection (VUS-PR)",
        "Random scores reach about the disturbed share.",
        (("evaluated_on", OVERALL),),
    ),
    StudyTable(
        "forecast",
        "forecast errors beside other forecasters",
        "All states (scaled) and all steps. Skill is against persistence.",
        (("state", "all"), ("step", 0)),
    ),
    StudyTable(
        "pilot",
        "the kinds of network of the paper's pilot study",
        "Errors of forecasts: all states (scaled) and all steps.",
        (("state", "all"), ("step", 0)),
    ),
    StudyTable(
        "nonlinearity",
        "what trees still find in the closed form's residuals",
        "The share of residual variance that gradient-boosted trees explain on validation "
        "recordings: zero or less says that nothing non-linear was left to learn.",
    ),
    StudyTable("training-time", "time to train"),
    StudyTable(
        "development",
        "scores on development recordings, by which the monitor's was chosen",
        "Development recordings are the only disturbed ones that anything was chosen by. The rule "
        "goes by the mean of AUROC and TNR@TPR95 over the cells of a set-up, and of those within "
        ".0005 of the highest takes the one with the highest F1; those that cannot be chosen have "
        "no rank.",
    ),
    StudyTable("development-cells", "the same, cell by cell, of the first and of what ships"),
    StudyTable(
        "confirmation",
        "another draw of the test recordings",
        "Simulated anew when everything was settled and scored once: what the monitor has there, "
        "and what it has on the test recordings.",
        (("evaluated_on", OVERALL), ("detector", MONITOR)),
    ),
    StudyTable("dropout", "dropout rates and numbers of draws"),
    StudyTable("leakage", "leakage probes of the study's detectors"),
)


def study_tables(results: Results) -> list[Table]:
    """Return the tables of the study that exist, folded."""
    found = [(given, results.study(given.name)) for given in STUDY_TABLES]
    return [_printed(given, table) for given, table in found if table is not None]


def missing_study(results: Results) -> list[str]:
    """Say which parts of the study are not in this report; nothing where none is missing."""
    tables = {given.title: results.study(given.name) for given in STUDY_TABLES}
    missing = [title for title, table in tables.items() if table is None]
    there = {title: table for title, table in tables.items() if table is not None}
    sentences = []
    if missing:
        sentences.append(
            "Not in this report, because the full study (`make study`) has not made them here: "
            f"{'; '.join(missing)}."
        )
    for setup in results.setups:
        lacking = [
            title
            for title, table in there.items()
            if "setup" in table and setup not in set(table.setup)
        ]
        if lacking:
            sentences.append(f"The study has left out of {setup}: {'; '.join(lacking)}.")
    return sentences


def seed_sentences(results: Results) -> list[str]:
    """Say what another training would change: from the study, or that it is not known."""
    table = results.study("seeds")
    if table is None:
        return [
            (
                "There is one training seed: the intervals do not hold how much the numbers would "
                "change with another training. The study trains again with other seeds; it has "
                "not been run here."
            )
        ]
    rows = table[(table.evaluated_on == OVERALL) & (table.protocol == "P2")]
    rows = rows[(rows.detector == MONITOR) & (rows.metric == "auroc")]
    told = [
        sentence
        for setup in results.setups
        for strength in results.strengths(setup)
        for sentence in _spread(same_strength(rows[rows.setup == setup], strength), strength)
    ]
    if not told:
        return ["The study's training seeds are of other set-ups than these."]
    return [
        (
            "The intervals are of one training. From seed to seed the AUROC of ODiSAR lies "
            f"between: {'; '.join(told)}."
        )
    ]


def _spread(rows: pd.DataFrame, strength: float) -> list[str]:
    return [
        f"{row['setup']} {at_strength(strength)}".strip()
        + f" {100 * row['smallest']:.1f} and {100 * row['largest']:.1f} % ({row['seeds']} seeds)"
        for row in rows.to_dict("records")
    ]


def _printed(given: StudyTable, table: pd.DataFrame) -> Table:
    title = f"Study: {given.title}"
    if given.name == "detection":
        frame = headline_table(table, every_detector=True)
        frame["detector"] = frame["detector"].map(detector_name)
        return frame_table(title, frame, given.note, folded=True)
    rows = table
    for column, value in given.only:
        rows = rows[rows[column] == value] if column in rows else rows
    note = given.note
    if len(rows) > _ROWS:
        note = f"{note} The first {_ROWS} of {len(rows)} rows.".strip()
    shown = rows.head(_ROWS)
    heads = [name for name in shown.columns if name not in dict(given.only)]
    lines = [_cells(line) for line in shown[heads].itertuples(index=False, name=None)]
    return Table(title, [str(name).replace("_", " ") for name in heads], lines, note, folded=True)


def _cells(values: Sequence[object]) -> list[str]:
    return [_cell(value) for value in values]


def _cell(value: object) -> str:
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, str):
        return detector_name(value)
    if isinstance(value, (int, np.integer)):
        return f"{value:,}"
    return number(value)
