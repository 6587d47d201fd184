import pytest

from odisar.deployment.bundle import read_bundle
from small_bundle import write_small_bundle


@pytest.fixture(scope="session")
def written(trained_twin, tmp_path_factory):
    """Return the folder of a bundle; not to be changed."""
    return write_small_bundle(tmp_path_factory.mktemp("bundles") / "small", trained_twin)


@pytest.fixture(scope="session")
def deployed(written):
    return read_bundle(written)
