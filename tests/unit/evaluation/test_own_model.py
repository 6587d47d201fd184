import sys

import numpy as np
import pytest

from odisar.errors import OdisarError
from odisar.evaluation.own_model import checked_scores, load_own_model
from small_system import make_recording

RECORDINGS = [make_recording("first", 30), make_recording("second", 40)]

MODULE = """
import numpy as np

LIMIT = 3.0

def score(recordings):
    return [np.abs(recording.values[:, 0]) for recording in recordings]

class Fitted:
    def score(self, recordings):
        return [np.full(len(recording.time_s), 2.0) for recording in recordings]

fitted = Fitted()

def too_few(recordings):
    return score(recordings)[:1]
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with a package of models, and forget its modules afterwards."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    package = tmp_path / "own_detectors"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "spikes.py").write_text(MODULE)
    (package / "needy.py").write_text("import a_library_nobody_has")
    (package / "broken.py").write_text("scale = 1 / 0")
    yield tmp_path
    for name in [name for name in sys.modules if name.split(".")[0] == "own_detectors"]:
        del sys.modules[name]


def test_a_function_is_found_by_its_dotted_name_and_asked_for_scores(folder):
    model = load_own_model("own_detectors.spikes:score", folder)
    assert model.name == "own_detectors.spikes:score"
    for scores, recording in zip(model.score(RECORDINGS), RECORDINGS, strict=True):
        np.testing.assert_array_equal(scores, np.abs(recording.values[:, 0]))


def test_a_method_of_an_object_is_found_too(folder):
    scores = load_own_model("own_detectors.spikes:fitted.score", folder).score(RECORDINGS)
    assert [len(item) for item in scores] == [30, 40]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("own_detectors.spikes", "write package.module:function"),
        ("own_detectors/spikes.py:score", "write package.module:function"),
        ("own_detectors.spikes:", "write package.module:function"),
        (":score", "write package.module:function"),
        ("own_detectors.missing:score", "no module 'own_detectors.missing'"),
        ("nowhere.spikes:score", "holds nowhere"),
        ("own_detectors.needy:score", "imports 'a_library_nobody_has', which is not installed"),
        ("own_detectors.broken:score", "can't be imported: ZeroDivisionError: division by zero"),
        ("own_detectors.spikes:scores", r"spikes\.py has no 'scores'"),
        ("own_detectors.spikes:fitted.scores", r"has no 'fitted\.scores'"),
        ("own_detectors.spikes:LIMIT", "is a float, which can't be called"),
    ],
)
def test_a_name_that_leads_nowhere_is_explained(folder, name, message):
    with pytest.raises(OdisarError, match=message):
        load_own_model(name, folder)


def test_a_model_that_answers_for_too_few_recordings_is_named(folder):
    model = load_own_model("own_detectors.spikes:too_few", folder)
    with pytest.raises(OdisarError, match="spikes:too_few' returned 1 arrays for 2 recordings"):
        model.score(RECORDINGS)


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (None, "returned nothing; return a list of 2 arrays"),
        (3.0, "returned a float"),
        ("ab", "returned a str"),
        ({"first": 1, "second": 2}, "returned a dict"),
        ([np.ones(30)], "1 arrays for 2 recordings"),
        ([np.ones(30), np.ones(39)], r"recording 'second': scores of shape \(39,\) for 40 samples"),
        ([np.ones((30, 1)), np.ones(40)], r"recording 'first': scores of shape \(30, 1\)"),
        ([["high"] * 30, np.ones(40)], "recording 'first': the scores are no numbers"),
        ([[[1], [1, 2]], np.ones(40)], "recording 'first': the scores are no numbers"),
    ],
)
def test_what_is_no_array_for_each_recording_is_refused_by_name(returned, message):
    with pytest.raises(OdisarError, match=f"'mine'.*{message}"):
        checked_scores("mine", returned, RECORDINGS)


def test_lists_and_single_precision_are_taken_as_they_are():
    returned = [[1] * 30, np.full(40, np.nan, dtype=np.float32)]
    first, second = checked_scores("mine", returned, RECORDINGS)
    assert first.dtype == second.dtype == np.float64
    assert np.isnan(second).all()
