"""Other programs' searches for a minimum within the unit box, each as in its manual.

A search is called with a function of individuals (m, p) in 0..1 to values (m,), the number of genes and a seed; it goes
on until that function ends it.
"""

import random

import cma
import numpy as np
import pygad
from deap import algorithms, base, creator, tools
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.problem import Problem
from pymoo.optimize import minimize as pymoo_minimize
from scipy.optimize import differential_evolution

GENERATIONS, POPULATION = 1400, 30
_CROSSED, _ELITES = 22, 2


def _stochastic_uniform(fitness, count, ga):
    """Parents on steps of equal length along a line where each individual's part goes as 1 / sqrt(rank)."""
    rank = np.empty(len(fitness))
    rank[np.argsort(-np.asarray(fitness))] = np.arange(1, len(fitness) + 1)
    share = 1.0 / np.sqrt(rank)
    ends = np.cumsum(share / share.sum())
    step = 1.0 / count
    chosen = np.searchsorted(ends, ga.draw.random() * step + step * np.arange(count)).clip(max=len(ends) - 1)
    ga.draw.shuffle(chosen)
    return ga.population[chosen].copy(), chosen


def _scattered(parents, size, ga):
    """Children whose genes are of either parent by chance, and after them parents that are mutated next."""
    children = np.empty(size)
    for k in range(size[0]):
        if k < _CROSSED:
            from_first = ga.draw.random(size[1]) < 0.5
            children[k] = np.where(from_first, parents[k], parents[(k + 1) % len(parents)])
        else:
            children[k] = parents[k % len(parents)]
    return children


def _shrinking(children, ga):
    """The last children moved by normal steps that shrink to zero over the generations."""
    size = 1.0 - ga.generations_completed / GENERATIONS
    for k in range(_CROSSED, len(children)):
        children[k] = np.clip(children[k] + size * ga.draw.standard_normal(children.shape[1]), 0.0, 1.0)
    return children


def pygad_own(rate, genes, seed):
    """PyGAD with the paper's operators as custom functions, and one call per individual."""
    ga = pygad.GA(
        num_generations=GENERATIONS,
        num_parents_mating=POPULATION,
        fitness_func=lambda _ga, one, _number: -float(rate(one[None])[0]),
        sol_per_pop=POPULATION,
        num_genes=genes,
        init_range_low=0.0,
        init_range_high=1.0,
        keep_elitism=_ELITES,
        parent_selection_type=_stochastic_uniform,
        crossover_type=_scattered,
        mutation_type=_shrinking,
        random_seed=seed,
        suppress_warnings=True,
    )
    ga.draw = np.random.default_rng(seed)
    ga.run()


def pymoo_ga(rate, genes, seed):
    """Pymoo's GA with its defaults, a generation at once."""

    class Box(Problem):
        def _evaluate(self, x, out, *_, **__):
            out["F"] = rate(x)

    box = Box(n_var=genes, n_obj=1, xl=0.0, xu=1.0)
    pymoo_minimize(box, GA(), ("n_gen", GENERATIONS), seed=seed)


def deap_ga(rate, genes, seed):
    """DEAP's mu + lambda with bounded crossover and mutation, a generation at once."""
    random.seed(seed)
    if not hasattr(creator, "Individual"):
        creator.create("Fitness", base.Fitness, weights=(-1.0,))
        creator.create("Individual", list, fitness=creator.Fitness)
    box, toolbox = {"low": 0.0, "up": 1.0, "eta": 20.0}, base.Toolbox()
    toolbox.register("gene", random.random)
    toolbox.register("individual", tools.initRepeat, creator.Individual, toolbox.gene, genes)
    toolbox.register("population", tools.initRepeat, list, toolbox.individual)
    toolbox.register("evaluate", lambda one: one)
    toolbox.register("map", lambda _, several: [(value,) for value in rate(np.array(list(several)))])
    toolbox.register("mate", tools.cxSimulatedBinaryBounded, **box)
    toolbox.register("mutate", tools.mutPolynomialBounded, indpb=1.0 / genes, **box)
    toolbox.register("select", tools.selTournament, tournsize=3)
    algorithms.eaMuPlusLambda(toolbox.population(n=100), toolbox, 100, 100, 0.7, 0.3, GENERATIONS, verbose=False)


def scipy_de(rate, genes, seed):
    """SciPy's differential evolution, a generation at once."""
    options = {"vectorized": True, "updating": "deferred", "rng": seed}
    differential_evolution(lambda x: rate(np.atleast_2d(x.T)), [(0.0, 1.0)] * genes, **options)


def pycma(rate, genes, seed):
    """CMA-ES, one generation per ask-and-tell call."""
    options = {"bounds": [0.0, 1.0], "seed": seed + 1, "verbose": -9}
    search = cma.CMAEvolutionStrategy(np.full(genes, 0.5), 0.3, options)
    while not search.stop():
        found = search.ask()
        search.tell(found, rate(np.array(found)).tolist())
