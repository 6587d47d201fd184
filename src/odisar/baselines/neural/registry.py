"""The neural detectors by name, in the order in which they are reported."""

from collections.abc import Callable

from torch import nn

from odisar.baselines.interface import Detector, Reference
from odisar.baselines.neural.conformal_cps import ConformalTransformations
from odisar.baselines.neural.ensemble import EnsembleReconstruction, EnsembleVariance, fit_members
from odisar.baselines.neural.gru_twin import GruReconstruction, fit_gru_twin
from odisar.baselines.neural.learning import SharedFit
from odisar.baselines.neural.published_network import PublishedNetwork
from odisar.baselines.neural.published_recipe import (
    PublishedRecipe,
    PublishedRecipeLastState,
    fit_published_network,
)
from odisar.baselines.neural.two_models import RnnThenAutoencoder
from odisar.baselines.neural.window_autoencoder import InputReconstruction
from odisar.fitting import FitBudget

PUBLISHED_RECIPE = "published-recipe"
PUBLISHED_RECIPE_LAST_STATE = "published-recipe-last-state"

#: Detectors whose score at t depends on what comes after t, or on other recordings.
NOT_DEPLOYABLE = (PUBLISHED_RECIPE, PUBLISHED_RECIPE_LAST_STATE)

_MEMBERS = 4
# Four members in twice the time of one twin; their validation loss has settled by then.
_MEMBER_STEPS_SHARE = 1 / 2
# A step of the published network takes as long as 15 of the GRU twin's. With so few it
# hasn't converged: a study with time to spare gives more steps to all, and sees it leak more.
_PUBLISHED_STEPS_SHARE = 3 / 20


def neural_detectors(budget: FitBudget) -> dict[str, Callable[[], Detector]]:
    """Return what makes each detector, by name.

    Both published recipes stand on one fit, and so do both scores of the ensemble: fitting the
    second of a pair on the same reference costs nothing.
    """

    def fit_published(reference: Reference) -> PublishedNetwork:
        return fit_published_network(reference, budget.part(_PUBLISHED_STEPS_SHARE))

    def fit_ensemble(reference: Reference) -> list[nn.Module]:
        members = budget.part(_MEMBER_STEPS_SHARE)
        return fit_members(lambda ref: fit_gru_twin(ref, members), _MEMBERS, reference)

    published, ensemble = SharedFit(fit_published), SharedFit(fit_ensemble)
    return {
        "rnn-then-autoencoder": lambda: RnnThenAutoencoder(budget),
        "gru-reconstruction": lambda: GruReconstruction(budget),
        "input-reconstruction": lambda: InputReconstruction(budget),
        PUBLISHED_RECIPE: lambda: PublishedRecipe(published),
        PUBLISHED_RECIPE_LAST_STATE: lambda: PublishedRecipeLastState(published),
        "ensemble-variance": lambda: EnsembleVariance(ensemble),
        "ensemble-reconstruction": lambda: EnsembleReconstruction(ensemble),
        "codit": lambda: ConformalTransformations(budget),
    }
