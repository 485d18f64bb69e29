"""Beyond the thesis: boundaries, extraordinary vertices, grids that are not smooth, areas of valence 8."""

from comparisons.beyond.claims import CLAIMS
from comparisons.beyond.figures import FIGURES, MAPS
from comparisons.beyond.measure import STEPS

__all__ = ["CLAIMS", "FIGURES", "MAPS", "STEPS", "TABLES", "TITLE"]

TITLE = "Beyond the thesis"
TABLES = {
    "beyond_boundaries": "Largest error of H on the border",
    "beyond_extraordinary": "Error of H by valence",
    "beyond_jitter": "Error of H on a torus with jitter",
    "beyond_valence_8": "One-norm of the error of H",
}
