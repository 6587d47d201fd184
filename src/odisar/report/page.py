"""The one-file report: a page with the run's facts around the body (see ``report.body``)."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from pygments.formatters import HtmlFormatter  # type: ignore[import-untyped]

from odisar.report.exhibits import Drawn
from odisar.report.stamp import CONTENT_META
from odisar.report.tables import Table


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


def render_page(
    title: str,
    body: str,
    facts: RunFacts,
    config: Mapping[str, Any],
    trial: SeaTrial | None = None,
) -> str:
    """Return the whole page; it needs no network and no other file."""
    return (
        templates()
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


def templates() -> jinja2.Environment:
    """Return the report's templates."""
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
