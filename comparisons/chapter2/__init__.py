"""Curves: Figures 2.1 to 2.7 of the thesis and the claims of its chapter 2."""

from comparisons.chapter2.claims import CLAIMS
from comparisons.chapter2.figures import FIGURES
from comparisons.chapter2.measure import STEPS

__all__ = ["CLAIMS", "FIGURES", "STEPS", "TABLES", "TITLE"]

TITLE = "Chapter 2: curves"
TABLES = {
    "figure_2_3": "Ellipse: largest error of kappa",
    "figure_2_5": "Euler spiral: largest error of kappa",
    "figure_2_7": "Helix: largest error",
    "figure_2_exact": "Circle and line: largest error of kappa",
    "figure_2_open_ends": "Open curves: largest error",
    "figure_2_uneven": "Steps that vary by half: largest error",
}
