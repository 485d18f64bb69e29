"""Convergence rates: slopes of log error against log size, positive where errors fall."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["fitted_rate", "successive_rates"]


def fitted_rate(sizes: ArrayLike, errors: ArrayLike) -> float:
    """Rate p of the least-squares fit error = C size^-p on logarithmic axes.

    Parameters
    ----------
    sizes : array_like, shape (m,)
        Distinct numbers of points (or cells) in one direction, m >= 2.
    errors : array_like, shape (m,)
        Errors, not negative.

    Returns
    -------
    float
        Positive for convergence; NaN where an error is zero or not finite.

    Raises
    ------
    ValueError
        For shapes that differ, fewer than two sizes, sizes that are not positive and distinct, or
        negative errors.
    """
    x, y = _logarithms(sizes, errors)
    x = x - x.mean()
    return -float(x @ y / (x @ x))


def successive_rates(sizes: ArrayLike, errors: ArrayLike) -> NDArray[np.float64]:
    """Rates between neighbouring sizes.

    Parameters
    ----------
    sizes, errors : array_like, shape (m,)
        As for `fitted_rate`.

    Returns
    -------
    ndarray, shape (m - 1,)
        Positive for convergence; NaN on both sides of an error that is zero or not finite.

    Raises
    ------
    ValueError
        As `fitted_rate`.
    """
    x, y = _logarithms(sizes, errors)
    return -np.diff(y) / np.diff(x)


def _logarithms(sizes: ArrayLike, errors: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, y = np.array(sizes, dtype=float), np.array(errors, dtype=float)
    if x.ndim != 1 or x.shape != y.shape or len(x) < 2:
        raise ValueError(
            "sizes and errors must be one-dimensional, of one length and at least two, "
            f"got shapes {x.shape} and {y.shape}"
        )
    if not (np.isfinite(x).all() and (x > 0).all() and len(np.unique(x)) == len(x)):
        raise ValueError(f"sizes must be positive, finite and distinct, got {x}")
    if (y < 0).any():
        raise ValueError(f"errors must not be negative, got {y.min():g}")
    y[(y == 0) | ~np.isfinite(y)] = np.nan
    return np.log(x), np.log(y)
