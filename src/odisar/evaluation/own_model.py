"""A detector of one's own: a function named ``package.module:function``, asked like any other.

The function has the signature of ``baselines.interface.Detector.score``: it takes recordings and
returns for each one an array (sample,) of scores, NaN where it has none yet, higher where the
recording is more abnormal::

    def score(recordings):
        return [np.abs(recording.values[:, 0]) for recording in recordings]
"""

import importlib
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odisar.errors import OdisarError
from odisar.recordings.schema import Recording

#: What scores recordings: one array (sample,) for each.
Score = Callable[[Sequence[Recording]], Sequence[NDArray[np.floating[Any]]]]


@dataclass(frozen=True)
class OwnModel:
    """A user's function under the dotted name it was found by."""

    name: str
    function: Score

    def score(self, recordings: Sequence[Recording]) -> list[NDArray[np.float64]]:
        """Return for each recording (sample,) scores.

        Raises
        ------
        OdisarError
            If the function doesn't return one array of the right length for each recording.
        """
        return checked_scores(self.name, self.function(recordings), recordings)


def load_own_model(name: str, folder: Path) -> OwnModel:
    """Return the model called ``package.module:function``, importing its module.

    Parameters
    ----------
    name
        Dotted name of the module, a colon, and the function's name in it (a method of an object
        in the module by its dotted name).
    folder
        Where the module is looked for before what is installed; it stays on the import path, so
        that the module may import its neighbours whenever it likes.

    Raises
    ------
    OdisarError
        If the name has another form, the module can't be found or imported, or it holds nothing
        callable of that name.
    """
    module_name, _, attribute = name.partition(":")
    if not (_is_dotted(module_name) and _is_dotted(attribute)):
        raise OdisarError(
            f"{name!r} names no model; write package.module:function, such as "
            "my_models.spikes:score for the function score in my_models/spikes.py"
        )
    found: Any = _import(module_name, folder)
    where = getattr(found, "__file__", None) or module_name
    for part in attribute.split("."):
        if not hasattr(found, part):
            raise OdisarError(f"{name!r}: {where} has no {attribute!r}; check the name")
        found = getattr(found, part)
    if not callable(found):
        raise OdisarError(
            f"{name!r} is a {type(found).__name__}, which can't be called; name a function that "
            "takes recordings and returns an array of scores for each"
        )
    return OwnModel(name, found)


def checked_scores(
    name: str, returned: object, recordings: Sequence[Recording]
) -> list[NDArray[np.float64]]:
    """Return what a model returned as one (sample,) array for each recording.

    Raises
    ------
    OdisarError
        If it isn't one array for each recording, or an array isn't one number for each sample.
    """
    wanted = f"return a list of {len(recordings)} arrays, one for each recording"
    if not isinstance(returned, Sequence | np.ndarray) or isinstance(returned, str):
        raise OdisarError(f"{name!r} returned {_described(returned)}; {wanted}")
    if len(returned) != len(recordings):
        raise OdisarError(
            f"{name!r} returned {len(returned)} arrays for {len(recordings)} recordings; {wanted}"
        )
    return [
        _checked_array(f"{name!r}, recording {recording.name!r}", scores, len(recording.time_s))
        for scores, recording in zip(returned, recordings, strict=True)
    ]


def _checked_array(where: str, scores: object, samples: int) -> NDArray[np.float64]:
    try:
        # A copy: a model may fill the same array anew at its next call.
        array = np.array(scores, dtype=np.float64)
    except (TypeError, ValueError):
        raise OdisarError(
            f"{where}: the scores are no numbers; return one number for each of its {samples} "
            "samples, NaN where there is no score yet"
        ) from None
    if array.shape != (samples,):
        raise OdisarError(
            f"{where}: scores of shape {array.shape} for {samples} samples; return shape "
            f"({samples},), NaN where there is no score yet"
        )
    return array


def _import(module_name: str, folder: Path) -> ModuleType:
    path = str(folder.resolve())
    if path not in sys.path:
        sys.path.insert(0, path)
    try:
        return importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
            raise OdisarError(
                f"{module_name} imports {error.name!r}, which is not installed; install it in the "
                "environment that runs odisar"
            ) from error
        raise OdisarError(
            f"no module {error.name!r}, neither in {path} nor installed; run from the folder that "
            f"holds {error.name.split('.')[0]}, or install it"
        ) from error
    except Exception as error:
        raise OdisarError(
            f"{module_name} can't be imported: {type(error).__name__}: {error}; mend it until "
            f'`python -c "import {module_name}"` succeeds'
        ) from error


def _is_dotted(name: str) -> bool:
    return all(part.isidentifier() for part in name.split("."))


def _described(returned: object) -> str:
    return "nothing" if returned is None else f"a {type(returned).__name__}"
