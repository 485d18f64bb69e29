"""Figures of convergence, for papers and notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from quadcurv.comparison import NORMS
from quadcurv.refinement import Convergence, fitted_rate
from quadcurv.types import Floats

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Of Okabe and Ito (2008): told apart with every kind of colour blindness."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", ">")

_UNITS = {"gaussian_curvature": "1/length²"}


class _Figure(Figure):
    def _repr_png_(self) -> bytes:
        """How a notebook shows it, with or without its own backend of matplotlib."""
        file = BytesIO()
        self.savefig(file, dpi=150)
        return file.getvalue()


def plot(convergence: Convergence, norms: Sequence[str] = ("one", "inf")) -> Figure:
    """Errors against cells in one direction on logarithmic axes, one panel a norm.

    Parameters
    ----------
    convergence : Convergence
    norms : sequence of str
        Of :data:`quadcurv.comparison.NORMS`.

    Returns
    -------
    matplotlib.figure.Figure
        The legend gives the fitted rate in each panel. Errors that are exactly 0 lie on the lower edge,
        with open markers.

    Raises
    ------
    ValueError
        No or unknown norms.

    Examples
    --------
    >>> import quadcurv as qc
    >>> run = qc.convergence("torus", ["finite_volume", "liu"], [8, 16, 32])
    >>> figure = qc.plot(run)
    >>> len(figure.axes)
    2
    """
    if not norms or isinstance(norms, str) or not set(norms) <= set(NORMS):
        raise ValueError(f"norms: expected any of {', '.join(NORMS)}, got {list(norms)}")
    n, symbol = convergence.sizes, convergence.symbol
    unit = _UNITS.get(convergence.quantity, "1/length")
    with rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = _Figure(
            figsize=(3.6 * len(norms), 3.4 + 0.11 * len(convergence.schemes)), layout="constrained"
        )
        figure.suptitle(f"{symbol} on {convergence.surface.replace('_', ' ')}, {convergence.layout}")
        for axes, norm in zip(figure.subplots(1, len(norms), squeeze=False)[0], norms, strict=True):
            series = {
                f"{scheme}: {convergence.rate_label(scheme, norm)}": convergence.norm(scheme, norm)
                for scheme in convergence.schemes
            }
            convergence_plot(axes, n, series, joined=True)
            axes.set(xlabel="cells in one direction", ylabel=f"{norm}-norm of the error in {symbol} ({unit})")
            axes.set_xticks(n, [f"{cells:.0f}" for cells in n])
            axes.grid(alpha=0.3, linewidth=0.5)
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


def convergence_plot(
    axes: Axes,
    sizes: ArrayLike,
    series: Mapping[str, ArrayLike],
    fit: Mapping[str, tuple[float, float]] | None = None,
    slopes: Sequence[float] = (),
    rounding: tuple[ArrayLike, str] | None = None,
    joined: bool = False,
    styles: Mapping[str, Mapping[str, Any]] | None = None,
) -> dict[str, float]:
    """Errors against size on logarithmic axes, with best-fit lines as the thesis draws them.

    Parameters
    ----------
    axes : matplotlib axes
        Drawn into; the caller labels them.
    sizes : array_like, shape (m,)
        Number of points or cells in one direction.
    series : mapping from label to array_like, shape (m,)
        Errors. Zeros lie on the lower edge of the plot with an open marker; NaN is left out.
    fit : mapping from label to (first, last) size, optional
        The sizes to fit, between two vertical dashed lines; a label not in it has no line.
    slopes : sequence of float
        Orders to show by grey reference lines above the last errors.
    rounding : (array_like of shape (m,), label), optional
        What rounding alone is expected to give, shown dotted.
    joined : bool
        Whether a thin line joins the errors.
    styles : mapping from label to mapping, optional
        Properties of a label's markers ("color", "marker", "fillstyle" and the like) that are not to
        follow its place in the series: a scheme keeps its own from figure to figure.

    Returns
    -------
    dict
        Fitted rate by label, for the labels in `fit`; NaN, and no line, where an error is zero.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from quadcurv.viewing import convergence_plot
    >>> axes = Figure().subplots()
    >>> rates = convergence_plot(axes, [8, 16, 32], {"liu": [4e-2, 1e-2, 2.5e-3]}, fit={"liu": (8, 32)})
    >>> round(rates["liu"], 6)
    2.0
    """
    n = np.asarray(sizes, dtype=float)
    errors = {label: np.asarray(e, dtype=float) for label, e in series.items()}
    positive = np.concatenate([e[np.isfinite(e) & (e > 0)] for e in errors.values()])
    floor = positive.min() / 10 if positive.size else np.finfo(float).eps
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    axes.minorticks_off()
    rates: dict[str, float] = {}
    markers = {label: _style(i) | dict((styles or {}).get(label, {})) for i, label in enumerate(errors)}
    for i, (label, e) in enumerate(errors.items()):
        style, text = markers[label], label
        if fit and label in fit:
            rates[label] = rate = _fitted_line(axes, n, e, fit[label], style["color"])
            text = f"{label}: rate {_signed(rate)}" if np.isfinite(rate) else label
        line = ("-" if i < len(COLOURS) else "--") if joined else "none"
        size = {"linewidth": 1.2, "markersize": 4.5} if joined else {}
        axes.plot(n, np.where(e == 0, np.nan, e), **{"linestyle": line, "label": text, **size, **style})
    for label, e in errors.items():
        zero = e == 0
        if zero.any():
            style = markers[label] | {"linestyle": "none", "fillstyle": "none"}
            axes.plot(n[zero], np.full(zero.sum(), floor), **style)
            axes.set_ylim(bottom=floor)
    for k, edge in enumerate(sorted({size for span in (fit or {}).values() for size in span})):
        axes.axvline(
            edge, color="0.4", linestyle="--", linewidth=0.9, label=None if k else "range of the fit"
        )
    top = max((e[-1] for e in errors.values() if e[-1] > 0), default=floor)
    for slope in slopes:
        _guide(axes, n, 4 * top, slope)
    if rounding is not None:
        level, label = rounding
        axes.plot(n, level, color="0.3", linestyle=":", label=f"rounding, {label}")
    axes.legend()
    return rates


def _style(i: int) -> dict[str, Any]:
    return {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)]}


def _signed(rate: float) -> str:
    """A rate with a true minus, and none before 0.00."""
    return f"{round(rate, 2) + 0.0:.2f}".replace("-", "\N{MINUS SIGN}")


def _fitted_line(axes: Axes, n: Floats, errors: Floats, span: tuple[float, float], colour: str) -> float:
    """Least-squares line over a range of sizes; its rate, NaN and no line where there is none."""
    inside = (n >= span[0]) & (n <= span[1])
    rate = fitted_rate(n[inside], errors[inside])
    if np.isfinite(rate):
        factor = np.exp(np.log(errors[inside] * n[inside] ** rate).mean())
        axes.plot(n[inside], factor * n[inside] ** -rate, color=colour)
    return rate


def _guide(axes: Axes, n: Floats, end: float, slope: float) -> None:
    """Grey line of an order over the finer half of the sizes."""
    tail = n[len(n) // 2 :]
    guide = end * (tail / n[-1]) ** -slope
    axes.plot(tail, guide, color="0.6", linewidth=0.9)
    middle = len(tail) // 2
    axes.text(tail[middle], guide[middle], f" order {slope:g}", color="0.4", va="bottom")
