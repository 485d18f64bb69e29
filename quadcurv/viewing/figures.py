"""Figures of convergence, for papers and notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from quadcurv.comparison import NORMS
from quadcurv.convergence import Convergence

# Okabe and Ito (2008): told apart with every kind of colour blindness.
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_MARKERS = "os^Dv*XP<>"


class _Figure(Figure):
    def _repr_png_(self) -> bytes:
        """How a notebook shows it, with or without its own backend of matplotlib."""
        file = BytesIO()
        self.savefig(file, dpi=150)
        return file.getvalue()


def convergence_figure(convergence: Convergence, norms: Sequence[str] = ("one", "inf")) -> Figure:
    """Errors against cells in one direction on logarithmic axes, one panel a norm.

    Parameters
    ----------
    convergence : Convergence
    norms : sequence of str
        Of :data:`quadcurv.comparison.NORMS`.

    Returns
    -------
    matplotlib.figure.Figure
        The legend gives the fitted rate in each panel. Errors that are exactly 0 have no place on the
        axis and are left out.

    Raises
    ------
    ValueError
        No or unknown norms.
    """
    if not norms or not set(norms) <= set(NORMS):
        raise ValueError(f"norms: expected any of {', '.join(NORMS)}, got {list(norms)}")
    n = convergence.sizes
    with rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = _Figure(
            figsize=(3.6 * len(norms), 3.4 + 0.11 * len(convergence.schemes)), layout="constrained"
        )
        figure.suptitle(f"Mean curvature on {convergence.surface.replace('_', ' ')}, {convergence.layout}")
        for axes, norm in zip(figure.subplots(1, len(norms), squeeze=False)[0], norms, strict=True):
            axes.set_xscale("log", base=2)
            axes.set_yscale("log")
            axes.set(xlabel="cells in one direction", ylabel=f"{norm}-norm of the error in H (1/length)")
            axes.set_xticks(n, [f"{cells:.0f}" for cells in n])
            axes.minorticks_off()
            axes.grid(alpha=0.3, linewidth=0.5)
            for i, scheme in enumerate(convergence.schemes):
                errors = np.array(convergence.errors[scheme][norm])
                errors[errors == 0] = np.nan
                axes.plot(
                    n,
                    errors,
                    color=_COLOURS[i % len(_COLOURS)],
                    marker=_MARKERS[i % len(_MARKERS)],
                    markersize=4.5,
                    linewidth=1.2,
                    linestyle="-" if i < len(_COLOURS) else "--",
                    label=f"{scheme}: {convergence.rate_label(scheme, norm)}",
                )
            axes.legend(
                title="fitted rate",
                loc="upper center",
                bbox_to_anchor=(0.5, -0.16),
                ncols=2,
                fontsize=8,
                title_fontsize=8,
                frameon=False,
            )
    return figure
