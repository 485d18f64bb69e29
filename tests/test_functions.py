"""Spherical harmonics: eigenfunctions, and what the operators make of them."""

from __future__ import annotations

import numpy as np
import pytest
from scripts import assert_as_declared, assert_one_size_of_type, drawn

from comparisons import common, functions
from quadcurv.schemes import SCHEMES, Laplacian


@pytest.fixture(scope="module")
def found():
    return common.measure(functions)


def test_verdicts_and_report(found) -> None:
    assert_as_declared(functions, found)


def test_figure(found) -> None:
    made = drawn(functions, found)
    assert_one_size_of_type(made)
    legend = [text.get_text() for text in made["functions"].legends[0].get_texts()]
    assert len(legend) == len(functions.operators())


def test_all_laplacians_are_compared() -> None:
    assert functions.operators() == [n for n, s in SCHEMES.items() if isinstance(s, Laplacian)]


@pytest.mark.parametrize("degree", functions.DEGREES)
def test_harmonics_are_eigenfunctions(degree) -> None:
    rng = np.random.default_rng(1)
    x = rng.normal(size=(20, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    h = 1e-3
    # Harmonic and homogeneous of degree l: then an eigenfunction with eigenvalue -l (l + 1).
    steps = np.concatenate((np.eye(3), -np.eye(3))) * h
    around = sum(functions.harmonic(degree, x + step) for step in steps)
    laplacian = (around - 6 * functions.harmonic(degree, x)) / h**2
    assert np.abs(laplacian).max() < 1e-7
    np.testing.assert_allclose(
        functions.harmonic(degree, 2 * x), 2**degree * functions.harmonic(degree, x), rtol=1e-12
    )
    # No axis of a grid is special to it.
    assert np.abs(functions._AXES).min() > 0.05


@pytest.mark.parametrize(
    ("sphere", "scheme", "degree", "one", "largest"),
    [
        ("longitude-latitude", "finite_volume", 3, 2.0, 2.0),
        ("longitude-latitude", "liu", 1, 2.0, 2.0),
        ("longitude-latitude", "bunge", 3, 2.0, 2.0),
        ("pillow", "finite_volume", 1, 2.0, 1.0),
        ("pillow", "finite_volume", 2, 1.1, 0.0),
        ("cubed", "liu", 3, 1.95, 0.95),
        ("icosahedral", "cotan-6", 3, 1.9, 0.0),
    ],
)
def test_rates(found, sphere, scheme, degree, one, largest) -> None:
    key = f"{sphere}: {scheme}, l = {degree}"
    assert found.numbers[f"{key}, one-norm, rate"] == pytest.approx(one, abs=0.1)
    assert found.numbers[f"{key}, inf-norm, rate"] == pytest.approx(largest, abs=0.12)


def test_errors_are_of_all_vertices() -> None:
    mesh = functions.SPHERES["longitude-latitude"](12)
    assert all(e.shape == (24 * 12,) for e in functions.errors(mesh, "liu").values())
    mesh = functions.SPHERES["cubed"](12)
    assert all(e.shape == (len(mesh.points),) for e in functions.errors(mesh, "liu").values())
