"""The one-file report: a body that follows from the results, and a page with the run's facts."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from pygments.formatters import HtmlFormatter  # type: ignore[import-untyped]

from odisar.report import answers, overview, tables
from odisar.report.exhibits import Drawn
from odisar.report.figures.blame import has_blame
from odisar.report.figures.forecasting import has_forecasts
from odisar.report.load import Results
from odisar.report.notebooks import notebook_html, notebook_title
from odisar.report.study import missing_study, study_tables
from odisar.report.summary import summarise
from odisar.report.tables import Table

#: Names the content that a page was made from, so that a stale page can be told.
CONTENT_META = "odisar-content"


@dataclass(frozen=True)
class SeaTrial:
    """The vessel simulator held against a sea trial; ``advice`` says how to get a missing one."""

    tables: Sequence[Table]
    figures: Sequence[Drawn]
    advice: str = ""


@dataclass(frozen=True)
class RunFacts:
    """What tracking knows about a run: identity, and what took how long."""

    content: str
    revision: str
    data: str
    experiment: str
    published_at: str
    stages: Sequence[tuple[str, str]]


def render_body(
    results: Results,
    figures: Sequence[Drawn],
    notebooks: Sequence[Path],
    plausibility: Sequence[Table],
) -> str:
    """Return everything of the report that follows from results alone, as an HTML fragment."""
    return (
        _templates()
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


def render_page(
    title: str,
    body: str,
    facts: RunFacts,
    config: Mapping[str, Any],
    trial: SeaTrial | None = None,
) -> str:
    """Return the whole page; it needs no network and no other file."""
    return (
        _templates()
        .get_template("page.html.j2")
        .render(
            title=title,
            body=Markup(body),  # noqa: S704 (made by render_body, which escapes)
            facts=facts,
            trial=trial,
            config=config,
            content_meta=CONTENT_META,
            code_style=Markup(HtmlFormatter().get_style_defs(".highlight")),  # noqa: S704
        )
    )


def page_content(path: Path) -> str | None:
    """Return the content that a page on disk was made from, or None."""
    if not path.is_file():
        return None
    head = path.read_text(encoding="utf-8")[:2000]
    _, found, rest = head.partition(f'<meta name="{CONTENT_META}" content="')
    return rest.partition('"')[0] if found else None


def _templates() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("odisar.report"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["data_uri"] = _data_uri
    return environment


def _data_uri(path: Path) -> str:
    return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"
