"""How the twins came to be: training curves and tuning trials."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from odisar.report.load import Results
from odisar.report.style import figure_style

#: Share of the room between two trial numbers over which folds are spread.
_FOLDS_WIDTH = 0.7
_TRAIN, _VALIDATION, _RECONSTRUCTION = "#56B4E9", "#0072B2", "#009E73"


def training_curves(results: Results, setup: str) -> Figure:
    """Draw forecast error and reconstruction loss over the epochs of each member."""
    members = list(results.limits(setup))
    histories = {name: pd.DataFrame(results.training[name]["history"]) for name in members}
    columns = min(3, len(members))
    rows = -(-len(members) // columns)
    with figure_style():
        figure = Figure(figsize=(max(3.1 * columns, 6.0), 2.3 * rows + 0.6))
        grid = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
        for axes, (name, history) in zip(grid, histories.items(), strict=False):
            epochs = history.epoch + 1
            lines = (
                ("train_forecast_mse", "forecast (training)", _TRAIN, "-"),
                ("validation_forecast_mse", "forecast (validation)", _VALIDATION, "-"),
                ("train_reconstruction_mse", "reconstruction (training)", _RECONSTRUCTION, "--"),
            )
            for column, label, colour, style in lines:
                axes.plot(epochs, history[column], color=colour, ls=style, marker=".", label=label)
            axes.set_title(name)
            axes.set_yscale("log")
            _whole_epochs(axes, len(history))
        for axes in grid[len(members) :]:
            axes.set_visible(False)
        figure.supxlabel("epoch", fontsize=9)
        figure.supylabel("mean squared error [scaled units$^2$]", fontsize=9)
        figure.legend(*grid[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _whole_epochs(axes: Axes, epochs: int) -> None:
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlim(0.5, epochs + 0.5)


def tuning_trials(results: Results) -> Figure:
    """Draw the validation forecast error of every trial, pruned ones hollow, the best ringed."""
    setups = results.setups
    with figure_style():
        figure = Figure(figsize=(max(3.3 * len(setups), 4.6), 2.9))
        grid = figure.subplots(1, len(setups), squeeze=False, sharey=True)[0]
        for axes, setup in zip(grid, setups, strict=True):
            _trials(axes, results, setup)
        grid[0].set_ylabel("validation forecast\nerror [scaled units$^2$]")
        figure.supxlabel("trial (0: the configured values)", fontsize=9)
        handles, labels = grid[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _trials(axes: Axes, results: Results, setup: str) -> None:
    trials = _all_trials(results, setup)
    complete = trials[trials.state == "complete"]
    pruned = trials[trials.state != "complete"]
    axes.scatter(
        complete.place, complete.validation_loss, color=_VALIDATION, s=24, label="complete"
    )
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
