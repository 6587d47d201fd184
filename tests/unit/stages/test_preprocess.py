import pandas as pd
import pytest

from odisar.errors import OdisarError
from odisar.stages.preprocess import require_disturbed


def splits(*rows: tuple[str, str, int, int]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["setup", "split", "disturbed", "overall"])


def test_a_set_up_that_nothing_disturbed_tests_is_named_with_the_way_out():
    overview = splits(("good", "test", 2, 2), ("calm", "test", 0, 0), ("calm", "development", 3, 3))
    with pytest.raises(OdisarError, match=r"'calm'.*labels\.csv.*faults"):
        require_disturbed(overview)


def test_a_set_up_whose_groups_select_nothing_disturbed_is_named_with_the_way_out():
    overview = splits(("good", "test", 2, 1), ("narrow", "test", 2, 0))
    with pytest.raises(OdisarError, match=r"'narrow'.*groups\.overall.*widen"):
        require_disturbed(overview)


def test_one_disturbed_fold_is_enough():
    require_disturbed(splits(("a", "test", 0, 0), ("a", "test", 1, 1), ("a", "train", 0, 0)))
