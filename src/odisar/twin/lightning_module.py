"""The twin in training: losses, optimiser and the reseeding that makes an epoch repeatable."""

import lightning as L
import torch
import torch.nn.functional as F

from odisar.config.learning import TwinConfig
from odisar.seeding import derive_seed
from odisar.twin.transformer import TwinTransformer
from odisar.windows.windowing import Batch, WindowSpec

VALIDATION_METRIC = "validation_forecast_mse"


class TwinModule(L.LightningModule):
    """L_total = L_forecast + L_recon (paper, Eqs. forecast-loss, recon-loss and total loss).

    Both are means over steps *and* states, a constant factor (the number of states) below the
    paper's sums over states.
    """

    def __init__(
        self, config: TwinConfig, spec: WindowSpec, features: int, learning_rate: float, seed: int
    ) -> None:
        super().__init__()
        torch.manual_seed(derive_seed(seed, "weights"))
        self.network = TwinTransformer(config, spec, features)
        self._detach = config.detach_reconstruction
        self._learning_rate = learning_rate
        self._seed = seed

    def on_train_epoch_start(self) -> None:
        """Reseed dropout by the epoch's number: a resumed run draws what an unbroken one draws."""
        torch.manual_seed(derive_seed(self._seed, "dropout", self.current_epoch))

    def training_step(self, batch: Batch, _batch_idx: int) -> torch.Tensor:
        """Return the joint loss of a batch."""
        output = self.network(batch.context, batch.known_future)
        target = output.forecast.detach() if self._detach else output.forecast
        forecast_loss = F.mse_loss(output.forecast, batch.truth)
        reconstruction_loss = F.mse_loss(output.reconstruction, target)
        size = len(batch.context)
        self.log("train_forecast_mse", forecast_loss, on_step=False, on_epoch=True, batch_size=size)
        self.log(
            "train_reconstruction_mse",
            reconstruction_loss,
            on_step=False,
            on_epoch=True,
            batch_size=size,
        )
        return forecast_loss + reconstruction_loss

    def validation_step(self, batch: Batch, _batch_idx: int) -> None:
        """Log the forecast error alone: it decides when to stop and what tuning keeps."""
        output = self.network(batch.context, batch.known_future)
        error = F.mse_loss(output.forecast, batch.truth)
        self.log(VALIDATION_METRIC, error, on_epoch=True, batch_size=len(batch.context))

    def configure_optimizers(self) -> torch.optim.Optimizer:
        """Return Adam, as published."""
        return torch.optim.Adam(self.parameters(), lr=self._learning_rate)
