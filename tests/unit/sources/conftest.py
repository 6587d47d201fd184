import hashlib

import pytest

from odisar.config.sources import GunnerusConfig

PUBLISHED = b"tvec,Azi\n0.0,1.0\n"


@pytest.fixture
def settings():
    """The section as a mapping, for a trial of two regimes: 170 RPM known, 110 RPM novel."""
    return {
        "file": {
            "url": "https://example.org/pinned/trial.csv",
            "sha256": hashlib.sha256(PUBLISHED).hexdigest(),
            "file_name": "trial.csv",
            "folder": "data/raw",
            "environment_variable": "ODISAR_TEST_TRIAL_CSV",
            "size_limit_mb": 1.0,
            "timeout_s": 1.0,
            "licence": "GPL-3",
            "credit": "A trial",
        },
        "raw_rate_hz": 2.0,
        "average_samples": 2,
        "roll_sign": -1,
        "regime_window_s": 5.0,
        "regimes": [
            {"name": "rpm-170", "min_rpm": 164.0, "max_rpm": 175.0, "use": "reference"},
            {"name": "rpm-110", "min_rpm": 95.0, "max_rpm": 125.0, "use": "novel"},
        ],
        "minimum_s": 20.0,
        "piece_s": 30.0,
    }


@pytest.fixture
def config(settings):
    return GunnerusConfig.model_validate(settings)
