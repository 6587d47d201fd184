"""How well a member's twin forecasts undisturbed test recordings, beside simpler forecasters."""

from collections.abc import Sequence

import pandas as pd

from odisar.capability.scoring import Scorer
from odisar.config.judging import EvaluationConfig
from odisar.evaluation.forecasts import (
    Forecast,
    ForecastErrors,
    forecast_errors,
    forecast_table,
    no_forecasts,
)
from odisar.forecasters.registry import cheap_forecasters
from odisar.stages.members import MemberData
from odisar.windows.windowing import window_positions

#: The trained twin among forecasters.
TWIN = "twin"


def member_accuracy(data: MemberData, scorer: Scorer) -> list[ForecastErrors]:
    """Return errors without the commands of the horizon and, where a case has some, with them.

    The twin is among those that know as much as it does. Nothing where no undisturbed test
    recording is as long as a window.
    """
    clean = [item for item in data.splits["test"] if not item.info.is_disturbed]
    if not window_positions(clean, data.spec, 1).size:
        return []
    planned = data.spec.known_ahead or data.spec.commands
    found = []
    for known in dict.fromkeys([(), planned]):
        given = data.knowing_commands(known)
        forecasts = _fitted(given)
        if known == data.spec.known_ahead:
            forecasts[TWIN] = scorer.forecast_windows
        found.append(forecast_errors(clean, given.scaler, given.spec, forecasts))
    return found


def accuracy_table(
    setup: str,
    parts: Sequence[Sequence[ForecastErrors]],
    states: Sequence[str],
    cfg: EvaluationConfig,
    base_seed: int,
) -> pd.DataFrame:
    """Return ``FORECAST_COLUMNS`` of a set-up; ``parts`` are what ``member_accuracy`` found."""
    by_commands: dict[str, list[ForecastErrors]] = {}
    for errors in (one for part in parts for one in part):
        by_commands.setdefault(errors.commands, []).append(errors)
    tables = [
        forecast_table(setup, ForecastErrors.joined(found), states, cfg, base_seed)
        for found in by_commands.values()
    ]
    return pd.concat([no_forecasts(), *tables])


def _fitted(data: MemberData) -> dict[str, Forecast]:
    fitted: dict[str, Forecast] = {}
    for name, make in cheap_forecasters(data.scaler, data.spec, data.case.rate_hz).items():
        forecaster = make()
        forecaster.fit(data.windows("train"), data.windows("validation"))
        fitted[name] = forecaster.forecast
    return fitted
