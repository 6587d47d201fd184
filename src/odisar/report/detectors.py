"""The detectors by name: what figures and tables call them, and how figures tell them apart."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

ORACLE = "oracle"
#: The detector that the project is about, the same without its Transformer, its other parts, and
#: the paper's score.
MONITOR, WITHOUT_TRANSFORMER = "odisar", "without-transformer"
CLOSED_FORM, CONSISTENCY, RECONSTRUCTION = "closed-form", "consistency", "reconstruction"

#: The twin's scores, and what the paper holds them against: the error of its forecasts.
FORECAST_ERRORS = ("rmse", "rmse-short-lead")
TWIN_SCORES = (
    MONITOR,
    WITHOUT_TRANSFORMER,
    CLOSED_FORM,
    CONSISTENCY,
    RECONSTRUCTION,
    *FORECAST_ERRORS,
)
#: What a user would try first: fitted in seconds, without a twin.
CHEAP = (
    "mahalanobis",
    "pca-t2",
    "pca-spe",
    "isolation-forest",
    "ecod",
    "pose-velocity",
    "rate-of-change",
    "stuck",
)
#: Networks of the study.
NEURAL = (
    "rnn-then-autoencoder",
    "gru-reconstruction",
    "input-reconstruction",
    "dropout-variance",
    "published-recipe",
    "published-recipe-last-state",
    "ensemble-variance",
    "ensemble-reconstruction",
    "codit",
)
#: Their score at t depends on what comes after t, or on other recordings.
NOT_DEPLOYABLE = ("published-recipe", "published-recipe-last-state")

DETECTOR_NAMES = {
    MONITOR: "ODiSAR",
    WITHOUT_TRANSFORMER: "ODiSAR without Transformer",
    CLOSED_FORM: "closed form alone",
    CONSISTENCY: "consistency alone",
    RECONSTRUCTION: "reconstruction (paper's score, causal)",
    "rmse": "forecast RMSE",
    "rmse-short-lead": "forecast RMSE, short lead",
    "mahalanobis": "Mahalanobis, window statistics",
    "pca-t2": "PCA T2",
    "pca-spe": "PCA SPE",
    "isolation-forest": "isolation forest",
    "ecod": "ECOD",
    "pose-velocity": "pose against velocity",
    "rate-of-change": "rate of change",
    "stuck": "stuck sensor",
    "rnn-then-autoencoder": "RNN, then autoencoder",
    "gru-reconstruction": "GRU twin, reconstruction",
    "input-reconstruction": "autoencoder of the input",
    "dropout-variance": "Monte Carlo variance",
    "published-recipe": "published recipe (sees the future; not deployable)",
    "published-recipe-last-state": "published recipe, last state as future (not deployable)",
    "ensemble-variance": "ensemble, variance",
    "ensemble-reconstruction": "ensemble, reconstruction",
    "codit": "CODiT",
    ORACLE: "oracle (knows 'disturbed now')",
}

# Okabe and Ito (2008) for the twin's scores; Tol's muted scheme (2021) for the others: both are
# told apart with any kind of colour vision. Detectors drawn in one figure differ in marker too.
_LOOKS = {
    MONITOR: ("#0072B2", "o"),
    WITHOUT_TRANSFORMER: ("#000000", "p"),
    CLOSED_FORM: ("#56B4E9", "s"),
    CONSISTENCY: ("#CC79A7", "<"),
    RECONSTRUCTION: ("#D55E00", "D"),
    "rmse": ("#E69F00", "^"),
    "rmse-short-lead": ("#8A6D00", "v"),
    "mahalanobis": ("#117733", "P"),
    "pca-t2": ("#AA4499", "^"),
    "pca-spe": ("#882255", "v"),
    "isolation-forest": ("#332288", "<"),
    "ecod": ("#88CCEE", ">"),
    "pose-velocity": ("#CC6677", "D"),
    "rate-of-change": ("#999933", "s"),
    "stuck": ("#44AA99", "*"),
    "rnn-then-autoencoder": ("#117733", "s"),
    "gru-reconstruction": ("#44AA99", "^"),
    "input-reconstruction": ("#999933", "v"),
    "dropout-variance": ("#661100", "h"),
    "published-recipe": ("#882255", "X"),
    "published-recipe-last-state": ("#CC6677", "P"),
    "ensemble-variance": ("#332288", "<"),
    "ensemble-reconstruction": ("#88CCEE", ">"),
    "codit": ("#AA4499", "D"),
    ORACLE: ("#555555", "X"),
}
#: A case's own rules and a user's own detectors, in the order in which they come.
_SPARE = (("#7F3B08", "h"), ("#666600", "p"), ("#1B1B1B", "d"), ("#B07AA1", "8"))


@dataclass(frozen=True)
class Look:
    """Colour and marker, so that colour is not the only difference."""

    colour: str
    marker: str


def detector_name(detector: str) -> str:
    """Return a detector's name for a legend."""
    return DETECTOR_NAMES.get(detector, detector)


def detector_look(detector: str, detectors: Sequence[str]) -> Look:
    """Return how a detector looks: the same in every figure, if it is one of the project's own.

    A detector that is not gets a look by its place among such detectors.
    """
    if detector in _LOOKS:
        return Look(*_LOOKS[detector])
    unknown = [name for name in detectors if name not in _LOOKS]
    return Look(*_SPARE[unknown.index(detector) % len(_SPARE)])


def alternatives(detectors: Collection[str]) -> list[str]:
    """Return those that are neither the twin's scores nor networks: cheap ones and rules."""
    known = [name for name in CHEAP if name in detectors]
    others = (*TWIN_SCORES, *CHEAP, *NEURAL, ORACLE)
    return known + [name for name in detectors if name not in others]
