"""Every result table, from what came of the members; cases are judged apart and stacked."""

from collections.abc import Mapping, Sequence

import pandas as pd

from odisar.capability.combined import ODISAR
from odisar.capability.scoring import DETECTORS
from odisar.config.cases import Case
from odisar.config.judging import Judging
from odisar.config.loader import ConfigView
from odisar.evaluation.blame import blame_table
from odisar.evaluation.cells import OVERALL
from odisar.evaluation.paired import Comparison, paired_table
from odisar.evaluation.reliability import reliability_curves, reliability_table
from odisar.evaluation.tables import (
    attribution_table,
    detection_table,
    operating_table,
    quadrant_table,
)
from odisar.evaluation.threshold_tables import Ruled, threshold_table
from odisar.seeding import derive_seed
from odisar.stages.accuracy import accuracy_table
from odisar.stages.assessing import MemberResult

#: The pairs of the default run; the study has all of them.
_COMPARISON = Comparison(ODISAR, protocols=("P2", "P2-guarded"), cells=(OVERALL,))

Results = Mapping[str, Sequence[MemberResult]]


def result_tables(config: ConfigView, results: Results) -> dict[str, pd.DataFrame]:
    """Return every result table by file name, from what came of the members by set-up."""
    tables: dict[str, list[pd.DataFrame]] = {}
    for name in config.active_cases:
        mine = {s: parts for s, parts in results.items() if config.setups[s].case == name}
        for key, table in _case_tables(config, name, mine).items():
            tables.setdefault(key, []).append(table)
    return {key: pd.concat(parts, ignore_index=True) for key, parts in tables.items()}


def _case_tables(config: ConfigView, name: str, mine: Results) -> dict[str, pd.DataFrame]:
    case: Case = config.cases[name]
    scored = {s: [r for part in parts for r in part.scored] for s, parts in mine.items()}
    published = {s: config.setups[s].published_as for s in mine}
    assessed = pd.concat([part.assessed for parts in mine.values() for part in parts])
    seed = derive_seed(config.seed, "bootstrap", name)
    cfg = Judging.of(config.evaluation, case)
    persistence_s = case.persistence_s
    alternatives = set(next(iter(scored.values()))[0].detectors) - set(DETECTORS)
    ruled = {
        s: [Ruled(part.scored, part.thresholds, part.promises) for part in parts]
        for s, parts in mine.items()
    }
    return {
        "detection": detection_table(
            scored, case.groups, cfg, persistence_s, seed, published, alternatives
        ),
        "operating": operating_table(scored, case.groups, cfg, persistence_s),
        "paired": paired_table(scored, case.groups, cfg, persistence_s, seed, _COMPARISON),
        "thresholds": threshold_table(ruled, case.groups, cfg, persistence_s),
        "quadrants": quadrant_table(assessed, case.groups, cfg, seed, published),
        "attribution": attribution_table(assessed, case.groups),
        "blame": blame_table(assessed, cfg, seed),
        **_reliability(config, case, mine, seed),
        "forecast": pd.concat(
            accuracy_table(s, [p.accuracy for p in parts], case.output_names, cfg, seed)
            for s, parts in mine.items()
        ),
        "nearness": pd.concat([part.nearness for parts in mine.values() for part in parts]),
        "leakage": pd.concat([part.leakage for parts in mine.values() for part in parts]),
    }


def _reliability(
    config: ConfigView, case: Case, mine: Results, seed: int
) -> dict[str, pd.DataFrame]:
    """Return how far distributions can be trusted; folds are pooled, each with its own fit."""
    tables, curves = [], []
    for setup, parts in mine.items():
        forecasts = [item for part in parts for item in part.forecasts]
        given = (setup, forecasts, case.output_names, config.evaluation, seed)
        # Folds are scaled by their own training recordings: physical units by the first's.
        tables.append(reliability_table(*given, scale=parts[0].target_std))
        curves.append(reliability_curves(*given))
    return {"reliability": pd.concat(tables), "reliability-curves": pd.concat(curves)}
