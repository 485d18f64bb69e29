"""Other formulas: Figures 4.1 to 4.4 of the thesis, error maps, and the claims of its chapter 4."""

from comparisons.chapter4.claims import CLAIMS
from comparisons.chapter4.figures import FIGURES, MAPS, PAGES
from comparisons.chapter4.measure import CASES, STEPS

__all__ = ["CLAIMS", "FIGURES", "MAPS", "PAGES", "STEPS", "TABLES", "TITLE"]

TITLE = "Chapter 4: other formulas"
TABLES = {f"chapter4_{case.replace(' ', '_')}": f"{case}: errors of kappa and signed" for case in CASES}
