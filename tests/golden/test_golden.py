"""Today's numbers against those of ``make_golden.py``, which says when to write them anew.

Tolerances are absolute: 1e-6 for the table (shares and seconds), 1e-3 for the ferry (m/s and
degrees; sensors round to 1e-2), 1e-5 for the twin's errors and innovations
(scaled units, 32-bit floats), 1e-6 for its variances, which are near 1e-3, and 1e-4 for its scores,
which stand on logs of squares.
"""

import json

import pandas as pd
import pytest

from golden import make_golden

TABLE_TOLERANCE, FERRY_TOLERANCE = 1e-6, 1e-3
TWIN_TOLERANCE, VARIANCE_TOLERANCE, SCORE_TOLERANCE = 1e-5, 1e-6, 1e-4
#: What isn't in the units of the twin's errors.
TOLERANCES = {
    "variance": VARIANCE_TOLERANCE,
    "score": SCORE_TOLERANCE,
    "closed_form_score": SCORE_TOLERANCE,
}


def test_the_detection_table_is_the_golden_one():
    golden = pd.read_csv(make_golden.DETECTION)
    pd.testing.assert_frame_equal(
        make_golden.detection(), golden, check_dtype=False, rtol=0, atol=TABLE_TOLERANCE
    )
    assert golden.published.notna().any()


def test_the_simulated_ferry_sails_the_golden_track():
    golden = pd.read_csv(make_golden.FERRY)
    pd.testing.assert_frame_equal(
        make_golden.ferry(), golden, check_dtype=False, rtol=0, atol=FERRY_TOLERANCE
    )
    assert set(golden.disturbed) == {0, 1}


@pytest.mark.parametrize(
    "part",
    [
        "score",
        "closed_form_score",
        "innovations",
        "reconstruction_error",
        "state_errors",
        "variance",
    ],
)
def test_a_twin_of_known_weights_scores_as_the_golden_one(part):
    golden = json.loads(make_golden.TWIN.read_text(encoding="utf-8"))[part]
    found = make_golden.twin()[part]
    tolerance = TOLERANCES.get(part, TWIN_TOLERANCE)
    assert len(found) == len(golden)
    for one, wanted in zip(found, golden, strict=True):
        assert one == pytest.approx(wanted, rel=0, abs=tolerance)


def test_a_twin_of_known_weights_is_assessed_as_the_golden_one():
    golden = json.loads(make_golden.TWIN.read_text(encoding="utf-8"))["assessments"]
    found = make_golden.twin()["assessments"]
    tolerances = dict.fromkeys(
        ["reconstruction_error", "issued_s", "start_s", "end_s"], TWIN_TOLERANCE
    )
    tolerances |= {"uncertainty_variance": VARIANCE_TOLERANCE, "score": SCORE_TOLERANCE}
    assert len(found) == len(golden)
    for one, wanted in zip(found, golden, strict=True):
        for key, tolerance in tolerances.items():
            assert one.pop(key) == pytest.approx(wanted.pop(key), rel=0, abs=tolerance)
        for key in ("state_attribution", "reconstruction_attribution"):
            blamed, wanted_blame = one.pop(key), wanted.pop(key)
            assert list(blamed) == list(wanted_blame)
            assert blamed == pytest.approx(wanted_blame, rel=0, abs=SCORE_TOLERANCE)
        assert one == wanted
    assert any(one["recon_exceeds_threshold"] != one["is_OOD"] for one in found)
    assert {one["category"] for one in found} == {"green", "yellow", "orange", "red"}
