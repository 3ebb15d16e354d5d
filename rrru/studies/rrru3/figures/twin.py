"""Progress of the search for the twin."""

from rrru.figures import style


@style.printed
def twin_search(tables, _options):
    """Objective of the search for the twin against the evaluations, a curve for every restart. The objective is minus
    the log probability of what the paper prints. Dots: where a restart ended; the three best are blue.
    """
    progress, restarts = tables["twin_progress"], tables["twin_restarts"]
    figure = style.new(style.SINGLE_MM, 70.0)
    axes = figure.subplots()
    nearest = restarts.nsmallest(_BEST, "objective_nat")["restart"].tolist()
    # candidates that cannot be driven have a large objective
    drawn = progress[progress["objective_nat"] < _HIGHEST * restarts["objective_nat"].min()]
    for restart, curve in drawn.groupby("restart"):
        among = restart in nearest
        look = {"color": style.BLUE if among else style.GREY, "zorder": 3 if among else 2}
        label = "three best restarts" if among else "other restarts"
        axes.step(curve["evaluations"], curve["objective_nat"], where="post", linewidth=0.8, label=label, **look)
        axes.plot(curve["evaluations"].iloc[-1], curve["objective_nat"].iloc[-1], ".", **look)
    reason = {"agreed": "three restarts agree within 1 %", "restarts": "all restarts ended", "time": "time was over"}
    axes.set_title(f"search ended: {reason[restarts['ended'].iloc[0]]}")
    axes.set(xlabel="evaluations of a restart", ylabel="objective (nat)", xlim=(0.0, None))
    axes.grid(True)
    style.legend_above(figure, [axes], columns=2)
    return figure


_BEST, _HIGHEST = 3, 1.5
