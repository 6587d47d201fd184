"""How the twins came to be: training curves and tuning trials."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from odisar.report.load import Results
from odisar.report.style import figure_style

#: Share of the room between two trial numbers over which folds are spread.
_FOLDS_WIDTH = 0.7
_FORECAST, _NEXT, _RECONSTRUCTION = "#0072B2", "#D55E00", "#009E73"


def training_curves(results: Results, setup: str) -> Figure:
    """Draw every part of the loss over the epochs of each member."""
    members = list(results.limits(setup))
    histories = {name: pd.DataFrame(results.training[name]["history"]) for name in members}
    columns = min(3, len(members))
    rows = -(-len(members) // columns)
    with figure_style():
        figure = Figure(figsize=(max(3.1 * columns, 6.8), 2.4 * rows + 0.8))
        grid = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
        for axes, (name, history) in zip(grid, histories.items(), strict=False):
            for values, label, colour, style in _curves(history):
                axes.plot(
                    history.epoch + 1, values, color=colour, ls=style, marker=".", label=label
                )
            axes.set_title(name)
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            _whole_epochs(axes, len(history))
        for axes in grid[len(members) :]:
            axes.set_visible(False)
        figure.supxlabel("epoch", fontsize=9)
        weighed = results.config.training.weigh_loss
        unit = "1: what the closed form leaves" if weighed else "scaled units$^2$"
        figure.supylabel(f"mean squared error\n[{unit}]", fontsize=9)
        figure.legend(*grid[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _curves(history: pd.DataFrame) -> list[tuple[pd.Series, str, str, str]]:
    """Return the parts of the loss: values, label, colour and line."""
    # The validation loss is the sum of both forecasts, in the units that they are trained in.
    forecast = history.validation_loss - history.validation_next_mse
    return [
        (history.train_forecast_mse, "forecast (training)", _FORECAST, ":"),
        (forecast, "forecast (validation)", _FORECAST, "-"),
        (history.train_next_mse, "next sample (training)", _NEXT, ":"),
        (history.validation_next_mse, "next sample (validation)", _NEXT, "-"),
        (history.train_reconstruction_mse, "reconstruction (training)", _RECONSTRUCTION, ":"),
    ]


def _whole_epochs(axes: Axes, epochs: int) -> None:
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlim(0.5, epochs + 0.5)


def tuning_trials(results: Results) -> Figure:
    """Draw the validation loss of every trial, pruned ones hollow, the best ringed."""
    setups = results.setups
    with figure_style():
        figure = Figure(figsize=(max(3.3 * len(setups), 4.6), 2.9))
        grid = figure.subplots(1, len(setups), squeeze=False, sharey=True)[0]
        for axes, setup in zip(grid, setups, strict=True):
            _trials(axes, results, setup)
        grid[0].set_ylabel("validation loss (both forecasts)")
        figure.supxlabel("trial (0: the configured values)", fontsize=9)
        handles, labels = grid[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _trials(axes: Axes, results: Results, setup: str) -> None:
    trials = _all_trials(results, setup)
    complete = trials[trials.state == "complete"]
    pruned = trials[trials.state != "complete"]
    axes.scatter(complete.place, complete.validation_loss, color=_FORECAST, s=24, label="complete")
    axes.scatter(
        pruned.place,
        pruned.validation_loss,
        facecolor="none",
        edgecolor="#777777",
        s=24,
        label="pruned",
    )
    if not complete.empty:
        best = complete.loc[complete.groupby("member").validation_loss.idxmin()]
        axes.scatter(
            best.place,
            best.validation_loss,
            s=110,
            facecolor="none",
            edgecolor="#D55E00",
            linewidth=1.4,
            label="chosen",
        )
    axes.set_title(setup)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _all_trials(results: Results, setup: str) -> pd.DataFrame:
    """Return every member's trials that have an error; ``place`` sets the members side by side."""
    studies = results.tuning(setup)
    step = _FOLDS_WIDTH / len(studies)
    trials = pd.concat(
        [
            pd.DataFrame(study["trials"]).assign(member=name, nth=nth)
            for nth, (name, study) in enumerate(studies.items())
        ],
        ignore_index=True,
    )
    trials["place"] = trials.number + step * (trials.nth - (len(studies) - 1) / 2)
    return trials[trials.validation_loss.notna()]
