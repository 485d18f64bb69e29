"""Surfaces: Figures 3.1 to 3.12 of the thesis and the claims of its chapter 3."""

from comparisons.chapter3.claims import CLAIMS
from comparisons.chapter3.figures import FIGURES, MAPS
from comparisons.chapter3.measure import CONVERGENCE, STEPS

__all__ = ["CLAIMS", "FIGURES", "MAPS", "STEPS", "TABLES", "TITLE"]

TITLE = "Chapter 3: surfaces"
TABLES = {stem: f"{title}: error of kappa" for stem, (_, title) in CONVERGENCE.items()} | {
    "figure_3_10": "Longitude-latitude sphere to 60 degrees: error of kappa",
    "figure_3_others": "Further surfaces: error of H",
    "figure_3_12": "Processor time of one thread",
}
