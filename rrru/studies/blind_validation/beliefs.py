"""Answers of the diagnosis and of other methods on a robot, from the same measurements and stated noise."""

import json
from time import perf_counter

import numpy as np
import pandas as pd

from rrru.diagnosis.diagnose import diagnose
from rrru.seeds import stream
from rrru.studies.blind_validation import rivals
from rrru.studies.blind_validation.verdicts import NONE, UNEXPLAINED, in_order


def beliefs(measurements, known, settings):
    """Frame `withheld_beliefs` of a measurement table of a MeasuredRobot, by GapSettings."""
    found = []
    for method, answer in _METHODS.items():
        start = perf_counter()
        effects, probabilities, share = answer(measurements, known, settings)
        said = {"effects": effects, "probabilities": json.dumps(probabilities) if probabilities else ""}
        found.append({"method": method, **said, "share_closed": share, "seconds": perf_counter() - start})
    return pd.DataFrame(found).assign(robot=known.campaign)


def _diagnosis(measurements, known, settings):
    """Verdict, probability by set of effects with all unexplained sets as one, and explained fraction."""
    result = diagnose(measurements, known, settings, details=False)
    probabilities = {}
    for (effects, unexplained), probability in result.inference.posterior.sets().items():
        name = UNEXPLAINED if unexplained else in_order("+".join(effects)) or NONE
        probabilities[name] = probabilities.get(name, 0.0) + probability
    return result.verdict["effects"], probabilities, result.verdict["share_closed"]


def _bic(measurements, known, settings):
    """The most probable set and the probability of each by BIC, without an explained fraction."""
    campaign = rivals.Campaign.of(measurements, known, settings.library(known.mechanism))
    return _most_probable(rivals.bayes_information(campaign))


def _lasso(measurements, known, settings):
    """The same with the lasso."""
    campaign = rivals.Campaign.of(measurements, known, settings.library(known.mechanism))
    return _most_probable(rivals.lasso(campaign, stream(settings.seed, "lasso", known.campaign)))


def _spike_and_slab(measurements, known, settings):
    """The same with the spike and slab."""
    campaign = rivals.Campaign.of(measurements, known, settings.library(known.mechanism))
    return _most_probable(rivals.spike_and_slab(campaign, stream(settings.seed, "spike_and_slab", known.campaign)))


def _gaussian_process(measurements, known, settings):
    """The explained fraction by a Gaussian process, without effects and probabilities."""
    campaign = rivals.Campaign.of(measurements, known, settings.library(known.mechanism))
    return "", {}, rivals.gaussian_process(campaign)


def _most_probable(probabilities):
    """The most probable set, ties broken by name, with all probabilities and no explained fraction."""
    return max(sorted(probabilities), key=probabilities.get), probabilities, np.nan


_METHODS = {
    "diagnosis": _diagnosis,
    "bic": _bic,
    "lasso": _lasso,
    "spike_and_slab": _spike_and_slab,
    "gaussian_process": _gaussian_process,
}
