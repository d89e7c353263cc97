"""Who cooks well with whom in a population: payoffs, preferences, incompatibility and whom to train with.

Strategies are numbered 0 to n - 1 in the order in which they came; `payoffs` is always float64 [n, n],
symmetric, complete and not negative, with self-play on the diagonal. Nothing here needs PyTorch.

Payoffs (`payoffs`): `PayoffTable`, `Cell`.
Preferences (`preference`): `preference_edges`, `in_degree`, `preference_centrality`, `centrality_matrix`,
`newest_centralities`, `Centrality`.
Popularity (`pagerank`): `weighted_pagerank`, `unpopularity`.
Coalitions (`shapley`): `pair_worths`, `coalition_value`, `sampled_shapley`, `exact_shapley`.
Solvers (`solvers`): `incompatibility`, `graphic_shapley`, `reward_solver`.
Trainer (`sampling`, `oracle`): `sucg`, `draw_partners`, `rank`, `accepted`, `removal`.

Source: Li et al., "Tackling Cooperative Incompatibility for Zero-Shot Human-AI Coordination" (COLE), Sec. 4
and 5.
"""

from galley.evaluation.game_graph.oracle import accepted, rank, removal
from galley.evaluation.game_graph.pagerank import unpopularity, weighted_pagerank
from galley.evaluation.game_graph.payoff_table import Cell, PayoffTable
from galley.evaluation.game_graph.preference import (
    Centrality,
    centrality_matrix,
    in_degree,
    newest_centralities,
    preference_centrality,
    preference_edges,
)
from galley.evaluation.game_graph.sampling import draw_partners, sucg
from galley.evaluation.game_graph.shapley import coalition_value, exact_shapley, pair_worths, sampled_shapley
from galley.evaluation.game_graph.solvers import graphic_shapley, incompatibility, reward_solver

__all__ = [
    "Cell",
    "Centrality",
    "PayoffTable",
    "accepted",
    "centrality_matrix",
    "coalition_value",
    "draw_partners",
    "exact_shapley",
    "graphic_shapley",
    "in_degree",
    "incompatibility",
    "newest_centralities",
    "pair_worths",
    "preference_centrality",
    "preference_edges",
    "rank",
    "removal",
    "reward_solver",
    "sampled_shapley",
    "sucg",
    "unpopularity",
    "weighted_pagerank",
]
