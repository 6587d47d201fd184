import numpy as np
import pytest

from odisar.artifacts import write_json
from odisar.report.figures.baselines import baselines_by_strength
from odisar.report.figures.learning import tuning_trials
from odisar.report.figures.quadrants import quadrant_distribution
from odisar.report.gallery import PLATES, draw_figures
from odisar.report.style import QUADRANTS, detector_colour, save_figure

from .invented import study, without_disturbed


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
        save_figure(baselines_by_strength(results, "vessel-all"), path, "strengths")
    one, two = (path.read_bytes() for path in paths)
    assert one == two
    assert b"Software" not in one


def test_bars_of_quadrants_are_stacked_to_all_windows(results):
    axes = quadrant_distribution(results, "vessel-all").axes[0]
    ends = [bar.get_x() + bar.get_width() for bar in axes.patches]
    assert len(ends) == len(QUADRANTS)
    assert max(ends) == pytest.approx(100)
    assert np.all(np.diff(ends) >= 0)


def test_every_figure_is_drawn_without_disturbed_recordings(results, tmp_path):
    without_disturbed(results)
    names = {item.path.stem for item in draw_figures(results, tmp_path / "figures")}
    assert "operating-point-vessel-all" in names
    assert "quadrants-vessel-all" not in names


def test_the_trials_of_every_fold_are_drawn_and_each_choice_is_ringed(results, workspace):
    folds = {f"vessel-all.fold-{n}": study(2 + n) for n in range(3)}
    write_json(workspace.tuned("vessel-all"), {"members": folds})
    complete, pruned, chosen = tuning_trials(results).axes[0].collections
    assert [len(part.get_offsets()) for part in (complete, pruned, chosen)] == [6, 3, 3]
    places = [x for part in (complete, pruned) for x in part.get_offsets()[:, 0]]
    assert len(set(places)) == len(places)
    assert all(x in places for x in chosen.get_offsets()[:, 0])
    assert {float(y) for y in chosen.get_offsets()[:, 1]} == {0.3}


def test_lead_times_of_a_narrowed_set_up_say_what_they_are_measured_against(results, tmp_path):
    drawn = draw_figures(results, tmp_path / "figures")
    noted = {item.path.stem for item in drawn if "maneuver random only" in item.caption}
    assert noted == {"operating-point-vessel-random"}


def test_colours_of_detectors_differ_and_do_not_depend_on_the_oracle():
    names = ["odisar", "rmse", "rpm-rule", "oracle"]
    colours = [detector_colour(name, names) for name in names]
    assert len(set(colours)) == len(names)
    assert detector_colour("rmse", names[:-1]) == colours[1]
