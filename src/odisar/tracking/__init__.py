"""MLflow, in one place: runs here, the registry in ``tracking.registry``."""

from odisar.tracking.runs import (
    FINISHED,
    PUBLISHED_TAG,
    ROOT_VARIABLE,
    TrackedRun,
    Tracker,
    content_key,
    data_hash,
    flatten,
    git_revision,
    initialise_store,
    tracking_root,
    tracking_uri,
)

__all__ = [
    "FINISHED",
    "PUBLISHED_TAG",
    "ROOT_VARIABLE",
    "TrackedRun",
    "Tracker",
    "content_key",
    "data_hash",
    "flatten",
    "git_revision",
    "initialise_store",
    "tracking_root",
    "tracking_uri",
]
