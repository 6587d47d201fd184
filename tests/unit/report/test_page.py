import re

import pytest

from odisar.report.body import render_body
from odisar.report.exhibits import Drawn
from odisar.report.figures.learning import tuning_trials
from odisar.report.load import SECTIONS
from odisar.report.page import RunFacts, render_page
from odisar.report.stamp import page_content
from odisar.report.style import save_figure
from odisar.stages import report as report_stage

from .altered import without_disturbed

FACTS = RunFacts("abc123", "f00", "beef", "odisar", "2026-01-01", [("train", "from cache")])


@pytest.fixture
def figures(results, tmp_path):
    path = tmp_path / "figures/one.png"
    save_figure(tuning_trials(results), path, "trials")
    return [Drawn("learning", "", "A caption", path)]


@pytest.fixture
def page(results, figures):
    body = render_body(results, figures, [], None)
    return render_page("A <title>", body, FACTS, {"seed": 1, "training.epochs": 25})


def test_the_page_needs_no_other_file_and_no_network(page):
    assert not re.findall(r"(?:src|href)=\"(?!data:|#)[^\"]*\"", page)
    assert not re.findall(r"<(?:script|link|iframe)|@import|url\(", page)


def test_text_of_recordings_and_parameters_is_escaped(page):
    assert "a value &lt;b&gt;" in page
    assert "A &lt;title&gt;" in page


def test_the_page_tells_which_content_it_is_of(page, tmp_path):
    path = tmp_path / "report.html"
    assert page_content(path) is None
    path.write_text(page)
    assert page_content(path) == "abc123"


def test_the_page_holds_figures_facts_and_parameters(page):
    for text in (
        "data:image/png;base64,",
        "from cache",
        "training.epochs: 25",
        "one training seed",
    ):
        assert text in page
    assert "The simulator" not in page


def test_the_body_is_the_same_twice(results, figures, tmp_path):
    assert render_body(results, figures, [], None) == render_body(results, figures, [], None)
    assert str(tmp_path) not in render_body(results, figures, [], None)


def test_a_body_can_be_made_without_disturbed_recordings(results, figures):
    without_disturbed(results)
    assert "Summary" in render_body(results, figures, [], None)


def test_stage_and_notebooks_may_read_the_same_parameters():
    assert report_stage.PARAMS == SECTIONS
