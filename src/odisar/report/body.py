"""The body of the report: all of it that follows from the results alone."""

from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from odisar.report import answers, overview, tables
from odisar.report.exhibits import Drawn
from odisar.report.figures.blame import has_blame
from odisar.report.figures.forecasting import has_forecasts
from odisar.report.load import Results
from odisar.report.notebooks import notebook_html, notebook_title
from odisar.report.page import templates
from odisar.report.study import missing_study, study_tables
from odisar.report.summary import summarise
from odisar.report.tables import Table


def render_body(
    results: Results,
    figures: Sequence[Drawn],
    notebooks: Sequence[Path],
    plausibility: Sequence[Table],
) -> str:
    """Return everything of the report that follows from results alone, as an HTML fragment."""
    return (
        templates()
        .get_template("body.html.j2")
        .render(
            title=results.config.report.title,
            cases=[results.config.cases[name].title for name in results.cases],
            summary=summarise(results),
            answers=_answers(results),
            overview=[overview.splits(results), overview.nearness(results)],
            quality=overview.quality(results),
            learning=[
                overview.training(results),
                *(
                    answers.forecasts(results, setup)
                    for setup in results.setups
                    if has_forecasts(results, setup)
                ),
                overview.thresholds(results),
                *(tables.parameters(results, setup) for setup in results.setups),
            ],
            figures=figures,
            study=study_tables(results),
            missing_study=missing_study(results),
            plausibility=plausibility,
            notebooks=[
                {"title": notebook_title(path), "html": Markup(notebook_html(path))}  # noqa: S704
                for path in notebooks
            ],
        )
    )


def _answers(results: Results) -> dict[str, list[Table]]:
    """Return the tables of each section of figures, in the paper's order of questions."""
    setups = results.setups
    return {
        "effectiveness": [
            tables.headline(results),
            tables.headline(results, every_detector=True),
            tables.operating(results),
            *(answers.effectiveness(results, setup) for setup in setups),
            *(table for setup in setups for table in answers.rules(results, setup)),
            *(table for setup in setups for table in tables.scenario_tables(results, setup)),
        ],
        "confidence": [
            *(table for setup in setups for table in answers.reliability(results, setup)),
            *(tables.quadrants(results, setup) for setup in setups),
        ],
        "alternatives": [
            *(answers.against_forecast_errors(results, setup) for setup in setups),
            *(answers.pairs(results, setup) for setup in setups),
            *(answers.leakage(results, setup) for setup in setups),
        ],
        "protocols": [tables.paper_protocol(results, setup) for setup in setups],
        "events": [answers.blame(results, setup) for setup in setups if has_blame(results, setup)],
    }
