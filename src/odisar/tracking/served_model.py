"""The model as MLflow loads it: this file is copied into it and run, nothing is unpickled."""

import logging
from pathlib import Path
from typing import Any

import mlflow
import pandas as pd
from mlflow.exceptions import MlflowException
from mlflow.protos.databricks_pb2 import INTERNAL_ERROR, INVALID_PARAMETER_VALUE
from mlflow.pyfunc.model import PythonModel

from odisar.deployment.bundle import read_bundle
from odisar.deployment.deployed import Deployed
from odisar.errors import OdisarError

_logger = logging.getLogger("odisar.served")


class ServedModel(PythonModel):
    """A deployed capability behind MLflow's interface; refusals are sentences, with status 400."""

    def load_context(self, context: Any) -> None:
        """Read and check the bundle."""
        self.deployed: Deployed = read_bundle(Path(context.artifacts["bundle"]))

    def predict(
        self, context: Any, model_input: pd.DataFrame, params: dict[str, Any] | None = None
    ) -> pd.DataFrame:
        """Return the assessments of a table of samples (see ``Deployed.assess``).

        MLflow drops ``params``, with a warning in its log, before they come here.
        """
        del context, params
        try:
            return self.deployed.assess(model_input)
        except OdisarError as error:
            raise MlflowException(str(error), INVALID_PARAMETER_VALUE) from None
        except Exception as error:
            # The scoring server would send the traceback to the client.
            _logger.exception("the samples were not assessed")
            kind = type(error).__name__
            raise MlflowException(
                f"the samples were not assessed: unexpected {kind}. This is a fault of the "
                "program, not of your data; the server's log shows where it happened.",
                INTERNAL_ERROR,
            ) from None


mlflow.models.set_model(ServedModel())
