import numpy as np

from odisar.capability.scoring import RecordingScores
from odisar.config.cases import RangeRule
from odisar.config.loader import load_config
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.stages.detectors import detector_scores


def test_range_rules_stand_beside_the_twins_scores_at_the_same_times(request):
    shipped = load_config(request.config.rootpath).cases["gunnerus"]
    rules = [
        shipped.range_rules[0],
        RangeRule(name="surge-rule", channel="Surge Speed", min=0.0, max=2.0),
    ]
    case = shipped.model_copy(update={"range_rules": rules})
    values = np.zeros((60, len(case.channels)))
    values[:, case.channel_names.index("Propeller Speed")] = 170.0
    values[40:, case.channel_names.index("Propeller Speed")] = 190.0
    values[:, case.channel_names.index("Surge Speed")] = 2.0
    recording = Recording("trial", RecordingInfo("gunnerus"), np.arange(60.0), values)
    positions = np.array([30, 49, 59])
    twin = {"odisar": np.array([0.1, np.nan, 0.3], dtype=np.float32)}
    found = detector_scores(case, recording, RecordingScores(positions, twin, np.zeros((3, 5))))
    assert list(found) == ["odisar", "rpm-rule", "surge-rule"]
    np.testing.assert_allclose(found["odisar"], [0.1, np.nan, 0.3], rtol=1e-6)
    np.testing.assert_allclose(found["rpm-rule"], [0.0, 1.0, 2.0], atol=1e-6)
    np.testing.assert_allclose(found["surge-rule"], 1.0, atol=1e-6)
    assert {scores.dtype for scores in found.values()} == {np.dtype(np.float64)}
