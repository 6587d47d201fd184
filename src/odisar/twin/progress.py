"""What a training run shows and remembers: a bar, and the metrics of every epoch."""

import sys
from typing import Any

import lightning as L
from tqdm import tqdm

from odisar.twin.lightning_module import VALIDATION_METRIC


class EpochHistory(L.Callback):
    """Keeps ``{epoch, metric: value}`` of every epoch, across an interruption as well.

    On a terminal it draws a bar at ``position`` (two runs side by side keep to their own line);
    in a log it prints a line an epoch instead.
    """

    def __init__(self, name: str, position: int, *, quiet: bool = False) -> None:
        self.rows: list[dict[str, float]] = []
        self._name, self._position, self._quiet = name, position, quiet
        self._bar: tqdm[Any] | None = None

    @property
    def state_key(self) -> str:
        """Name of this callback's part of a checkpoint."""
        return "EpochHistory"

    def state_dict(self) -> dict[str, Any]:
        """Return the epochs so far."""
        return {"rows": self.rows}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Go on from a checkpoint's epochs."""
        self.rows = state_dict["rows"]

    def on_train_start(self, trainer: L.Trainer, _module: L.LightningModule) -> None:
        """Open the bar."""
        if not self._quiet:
            total = int(trainer.num_training_batches) * (trainer.max_epochs or 0)
            self._bar = tqdm(
                total=total,
                initial=trainer.global_step,
                desc=self._name,
                unit="step",
                position=self._position,
                disable=not sys.stderr.isatty(),
                leave=True,
            )

    def on_train_batch_end(self, *_args: Any) -> None:
        """Move the bar."""
        if self._bar is not None:
            self._bar.update()

    def on_train_epoch_end(self, trainer: L.Trainer, _module: L.LightningModule) -> None:
        """Keep the epoch's metrics, before the checkpoint of the same epoch is written."""
        metrics = {name: float(value) for name, value in trainer.callback_metrics.items()}
        self.rows.append({"epoch": trainer.current_epoch, **metrics})
        if self._bar is None:
            return
        best = min(row[VALIDATION_METRIC] for row in self.rows)
        shown = f"validation {metrics[VALIDATION_METRIC]:.4f}, best {best:.4f}"
        self._bar.set_postfix_str(shown)
        if self._bar.disable:
            epoch = f"epoch {trainer.current_epoch + 1}/{trainer.max_epochs}"
            sys.stderr.write(f"{self._name}: {epoch}, {shown}\n")

    def on_train_end(self, *_args: Any) -> None:
        """Close the bar."""
        if self._bar is not None:
            self._bar.close()
