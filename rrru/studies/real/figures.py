"""Figures of real arms: model after model with the budget of the gap, and the waves of every joint."""

import numpy as np

from rrru.figures import gap_budget, style

_OURS = {"color": style.BLUE, "marker": "s"}
_OTHERS = {"color": style.VERMILION, "marker": "D", "markerfacecolor": "white", "linestyle": "none"}
_ROW_MM, _JOINT_MM = 52.0, 36.0
_MICRORAD = 1e6


@style.printed
def steps(tables, options):
    """Real robot, a row per series. Left: what model after model leaves on rows no fit has seen, ours, others' fits
    of the same model, and last the model of the named causes. Right: what the gap is made of.
    """
    verdicts, models, budget = (tables[name] for name in ("real_verdicts", "real_steps", "real_budget"))
    if verdicts.empty:
        return _nothing(options)
    figure = style.new(style.DOUBLE_MM, 8.0 + _ROW_MM * len(verdicts))
    panels = figure.subplots(len(verdicts), 2, squeeze=False, width_ratios=(1.0, 1.2))
    for row, (left, right) in zip(verdicts.to_dict("records"), panels, strict=True):
        own = models[models["campaign"] == row["campaign"]]
        left.plot(own["model"], own["held_out_rms_mm"], label="held-out rows", **_OURS)
        known = {model: row[f"reference_{model}_rms_mm"] for model in "abcde"}
        known = {model: value for model, value in known.items() if np.isfinite(value) and model in set(own["model"])}
        if known:
            left.plot([*known], [*known.values()], label="others' fit", **_OTHERS)
        left.set(yscale="log", ylabel="rms (mm)", xlabel="model")
        left.grid(True, which="both")
        left.set_title(row["campaign"])
        left.legend()
        gap_budget.draw(right, budget[budget["campaign"] == row["campaign"]])
        right.set_title(
            f"{row['effects'].replace('_', ' ').replace('+', ' + ')}, p = {row['probability']:.2f}", wrap=True
        )
    return figure


@style.printed
def spectrum(tables, options):
    """Waves of every joint's angle in a real arm, a column per series: amplitude of the one wave that fits what is left
    beside the calibrated model (before) and beside that of the named causes (after). Bars: what the error function of
    the joint was found to hold. Orders that are nearer than the resolution cannot be told apart.
    """
    waves = tables["real_spectrum"]
    if waves.empty:
        return _nothing(options)
    names, joints = (list(dict.fromkeys(waves[name])) for name in ("campaign", "joint"))
    figure = style.new(style.DOUBLE_MM, 14.0 + _JOINT_MM * len(joints))
    panels = figure.subplots(len(joints), len(names), squeeze=False, sharex=True, sharey="row")
    for column, name in enumerate(names):
        for axes, joint in zip(panels[:, column], joints, strict=True):
            own = waves[(waves["campaign"] == name) & (waves["joint"] == joint)]
            axes.bar(own["order"], _MICRORAD * own["found_rad"], color="#cccccc", label="found function")
            axes.plot(own["order"], _MICRORAD * own["before_rad"], color=style.VERMILION, label="before")
            axes.plot(own["order"], _MICRORAD * own["after_rad"], color=style.BLUE, label="after")
            axes.set_title(f"{name}, {joint}, resolution {own['resolution'].iloc[0]:.2f}")
            axes.grid(True)
        panels[-1, column].set_xlabel("waves per turn")
    for axes in panels[:, 0]:
        axes.set_ylabel("amplitude (urad)")
    style.legend_above(figure, panels.ravel(), columns=3)
    return figure


def _nothing(options):
    """A page that says that no file of the set is here."""
    figure = style.new(style.DOUBLE_MM, 30.0)
    figure.text(0.5, 0.5, f"{options['set']}: no file of this set is here", ha="center", va="center")
    return figure
