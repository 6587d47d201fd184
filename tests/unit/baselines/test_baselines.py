import numpy as np

from odisar.baselines.forecast_error import delayed, forecast_rmse


def test_rmse_is_over_the_lead_and_all_states():
    forecast = np.zeros((1, 4, 2), dtype=np.float32)
    truth = np.array([[[3, 4], [0, 0], [9, 9], [9, 9]]], dtype=np.float32)
    assert forecast_rmse(forecast, truth, 2)[0] == np.float32(2.5)


def test_an_error_is_known_when_its_horizon_has_passed():
    known = delayed(np.array([1, 2, 3, 4], dtype=np.float32), 2)
    assert np.isnan(known[:2]).all()
    assert known[2:].tolist() == [1, 2]


def test_a_horizon_longer_than_the_segment_is_never_known():
    assert np.isnan(delayed(np.array([1, 2], dtype=np.float32), 5)).all()
