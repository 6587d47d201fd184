import numpy as np
import pytest

from odisar.report.figures.baselines import baselines_by_strength
from odisar.report.figures.quadrants import quadrant_distribution
from odisar.report.gallery import PLATES, draw_figures
from odisar.report.style import QUADRANTS, detector_colour, save_figure


def test_every_figure_that_applies_is_drawn_and_old_ones_go(results, tmp_path):
    folder = tmp_path / "figures"
    folder.mkdir()
    (folder / "of-a-set-up-that-is-gone.png").touch()
    drawn = draw_figures(results, folder)
    assert {item.path.name for item in drawn} == {path.name for path in folder.glob("*.png")}
    assert folder / "event-vessel-random.png" in {item.path for item in drawn}
    assert not any("fault" in item.path.name for item in drawn)


@pytest.mark.parametrize("plate", PLATES, ids=lambda plate: plate.name)
def test_no_panel_is_left_empty(results, plate):
    subject = "vessel-all" if plate.scope == "setup" else "vessel"
    if not plate.applies(results, subject):
        pytest.skip("does not apply to these results")
    for axes in plate.draw(results, subject).axes:
        assert axes.has_data() or axes.texts


def test_a_figure_is_the_same_bytes_twice_and_names_no_program(results, tmp_path):
    paths = [tmp_path / "one.png", tmp_path / "two.png"]
    for path in paths:
        save_figure(baselines_by_strength(results, "vessel-all"), path)
    one, two = (path.read_bytes() for path in paths)
    assert one == two
    assert b"Software" not in one


def test_bars_of_quadrants_are_stacked_to_all_windows(results):
    axes = quadrant_distribution(results, "vessel-all").axes[0]
    ends = [bar.get_x() + bar.get_width() for bar in axes.patches]
    assert len(ends) == len(QUADRANTS)
    assert max(ends) == pytest.approx(100)
    assert np.all(np.diff(ends) >= 0)


def test_colours_of_detectors_differ_and_do_not_depend_on_the_oracle():
    names = ["odisar", "rmse", "rpm-rule", "oracle"]
    colours = [detector_colour(name, names) for name in names]
    assert len(set(colours)) == len(names)
    assert detector_colour("rmse", names[:-1]) == colours[1]
