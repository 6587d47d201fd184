"""The twin in training: losses, optimiser and the reseeding that makes an epoch repeatable."""

import lightning as L
import torch
import torch.nn.functional as F

from odisar.seeding import derive_seed
from odisar.twin.plan import TrainingPlan
from odisar.twin.transformer import TwinOutput, TwinTransformer
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import Batch

#: What decides when to stop and what tuning keeps: errors of forecasts, nothing else.
VALIDATION_METRIC = "validation_loss"


class TwinModule(L.LightningModule):
    """L_total = L_forecast + L_recon + L_next (paper, Eqs. forecast-loss, recon-loss, total loss).

    The first two are means over steps *and* states, a constant factor (the number of states) below
    the paper's sums over states; the third is ours: the error of the next sample, in units of what
    the closed form leaves. With ``weigh_loss`` the first two are in such units as well, so that
    what nothing can forecast does not take all of the loss.
    """

    def __init__(self, plan: TrainingPlan, windows: WindowSet) -> None:
        super().__init__()
        torch.manual_seed(derive_seed(plan.seed, "weights"))
        self.network = TwinTransformer(plan.twin, windows.spec, windows.channels)
        self.network.fit_closed_forms(windows)
        self._plan = plan

    def on_train_epoch_start(self) -> None:
        """Reseed dropout by the epoch's number: a resumed run draws what an unbroken one draws."""
        torch.manual_seed(derive_seed(self._plan.seed, "dropout", self.current_epoch))

    def training_step(self, batch: Batch, _batch_idx: int) -> torch.Tensor:
        """Return the joint loss of a batch."""
        memory = self.network.encode(batch.context)
        output = self.network.decode(memory, batch.context, batch.known_future)
        target = output.forecast
        target = target.detach() if self._plan.twin.detach_reconstruction else target
        losses = {
            "forecast_mse": _mse(self._weighed(output.forecast, batch.truth)),
            "reconstruction_mse": _mse(self._weighed(output.reconstruction, target)),
            "next_mse": _mse(self._following(memory, batch)),
        }
        self._log("train", losses, len(batch.context))
        return torch.stack(list(losses.values())).sum()

    def validation_step(self, batch: Batch, _batch_idx: int) -> None:
        """Log forecast errors alone: their sum decides when to stop and what tuning keeps."""
        output = self.network(batch.context, batch.known_future)
        forecast = _mse(self._weighed(output.forecast, batch.truth))
        following = _mse(self._next_sample(output, batch))
        losses = {
            "forecast_mse": F.mse_loss(output.forecast, batch.truth),
            "next_mse": following,
            "loss": forecast + following,
        }
        self._log("validation", losses, len(batch.context))

    def _weighed(self, *horizons: torch.Tensor) -> tuple[torch.Tensor, ...]:
        """Return tensors (window, step, state) in the units that the loss is in."""
        if not self._plan.training.weigh_loss:
            return horizons
        return tuple(x / self.network.horizon_spread for x in horizons)

    def _next_sample(self, output: TwinOutput, batch: Batch) -> tuple[torch.Tensor, ...]:
        truth = batch.next_sample[:, list(self.network.state_features)]
        spread = self.network.next_closed_form.spread
        return output.next_sample / spread, truth / spread

    def _following(self, memory: torch.Tensor, batch: Batch) -> tuple[torch.Tensor, ...]:
        """Return forecast and truth (window, token, state feature) of the sample after each token.

        A window has many of them: the part of the loss that innovations come from learns faster.
        """
        network = self.network
        ends = network.token_ends
        forecast = network.following_samples(memory[:, -len(ends) :], batch.context)
        samples = torch.cat([batch.context, batch.next_sample[:, None]], dim=1)
        truth = samples[:, ends][..., list(network.state_features)]
        spread = network.next_closed_form.spread
        return forecast / spread, truth / spread

    def _log(self, split: str, losses: dict[str, torch.Tensor], size: int) -> None:
        named = {f"{split}_{name}": value for name, value in losses.items()}
        self.log_dict(named, on_step=False, on_epoch=True, batch_size=size)

    def configure_optimizers(self) -> torch.optim.Optimizer:
        """Return Adam, as published."""
        return torch.optim.Adam(self.parameters(), lr=self._plan.training.learning_rate)


def _mse(pair: tuple[torch.Tensor, ...]) -> torch.Tensor:
    """Return the mean squared difference of two tensors of a shape."""
    return F.mse_loss(pair[0], pair[1])
