"""The claims of the thesis's abstract, introduction and conclusion, beside the numbers of all chapters."""

from __future__ import annotations

import numpy as np

from comparisons.claims import Claim, below, exactly, near, rate
from comparisons.measured import Measured, curvature_errors
from quadcurv import QuadGrid, QuadMesh, mean_curvature
from quadcurv.schemes import cotan
from quadcurv.surfaces import cubed_ellipsoid, torus

FV = "finite_volume"


def face_lists(into: Measured) -> None:
    """A grid against the same quads as a shuffled face list; a mesh of which quads are cut in two."""
    grid, *_ = torus().sample((48, 48))
    assert isinstance(grid, QuadGrid)
    faces = grid.to_mesh().faces
    rng = np.random.default_rng(0)
    start = (rng.integers(4, size=(len(faces), 1)) + np.arange(4)) % 4
    shuffled = rng.permutation(np.take_along_axis(faces, start, axis=1))
    H = mean_curvature(QuadMesh(grid.points.reshape(-1, 3), shuffled), FV)
    into.numbers["grid against shuffled faces"] = float(np.abs(H - mean_curvature(grid, FV).ravel()).max())
    mesh, xi, eta = cubed_ellipsoid().sample((32, 32), "faces")
    faces = np.array(mesh.faces)
    cut = np.random.default_rng(0).random(len(faces)) < 1 / 3
    quads, halves = faces[~cut], faces[cut]
    triangles = np.concatenate((halves[:, [0, 1, 2]], halves[:, [2, 3, 0]]))
    pieces = QuadMesh(
        mesh.points, np.concatenate((quads, np.pad(triangles, ((0, 0), (0, 1)), constant_values=-1)))
    )
    exact = cubed_ellipsoid().mean_curvature(xi, eta)
    for scheme in (FV, "liu"):
        error = np.abs(mean_curvature(pieces, scheme) - exact)
        into.numbers[f"mixed mesh, {scheme}"] = float(error.mean())


def against_cotan(into: Measured) -> None:
    """Errors on the torus: the scheme over cotan 6, and cotan by the cut of the quads."""
    for layout in ("staggered", "grid"):
        fv, six = (curvature_errors(torus(), (128, 128), s, layout).norm.mean() for s in (FV, "cotan-6"))
        into.numbers[f"torus, {layout}: finite_volume over cotan-6"] = float(fv / six)
    for name, scheme in (
        ("valence 4", "cotan-4"),
        ("valence 6", "cotan-6"),
        ("valence 6, other diagonal", cotan(6, diagonal=1)),
        ("valence 8", "cotan-8"),
    ):
        error = curvature_errors(torus(), (64, 64), scheme, "staggered").norm.mean()
        into.numbers[f"torus, 64: {name}"] = float(error)


def metric(into: Measured) -> None:
    """Eigenvalues of the metric tensor of the torus at eta = 1, and its principal curvatures."""
    xi, eta, d = 0.0, 1.0, 1e-5
    tangents = np.stack(
        (
            torus().mapping(xi + d, eta) - torus().mapping(xi - d, eta),
            torus().mapping(xi, eta + d) - torus().mapping(xi, eta - d),
        )
    ) / (2 * d)
    first, second = np.linalg.eigvalsh(tangents @ tangents.T)
    k1, k2 = torus().principal_curvatures(xi, eta)
    into.numbers |= {
        "1.1.1 metric, smaller": float(first),
        "1.1.1 metric, larger": float(second),
        "1.1.1 curvature, smaller": float(k2),
        "1.1.1 curvature, larger": float(k1),
    }


TITLE = "Chapters 1 and 5: introduction and conclusion"
STEPS = {"face lists": face_lists, "against cotan": against_cotan, "metric tensor": metric}

FIRST = [
    Claim(
        "1.1.1",
        "The principal curvatures are the eigenvalues of the metric tensor",
        "at eta = 1 on the torus the eigenvalues of the metric tensor are {} and {}, the principal "
        "curvatures {} and {}: those of the shape operator",
        (
            near("1.1.1 metric, smaller", 1, 0.1),
            near("1.1.1 metric, larger", 6.453, 0.1),
            near("1.1.1 curvature, smaller", 0.2127, 0.1),
            near("1.1.1 curvature, larger", 1, 0.1),
        ),
        "slip",
    ),
    Claim(
        "1.1.2",
        "Triangulations of a quadrilateral mesh produce different results with the cotan formula",
        "one-norm of the error on the torus, 64 cells: valence 4 {}, valence 6 {}, with the other "
        "diagonal {}, valence 8 {}",
        (
            near("torus, 64: valence 4", 0.341),
            near("torus, 64: valence 6", 1.92e-3),
            near("torus, 64: valence 6, other diagonal", 5.48e-4),
            near("torus, 64: valence 8", 0.17),
        ),
    ),
    Claim(
        "1.1.2",
        "A scheme built on quadrilaterals converges more generally over the same points than a triangulation",
        "on the pillow grid the scheme's rate is {} in the one-norm, that of cotan 6 {}; on points moved "
        "by 5 % of the spacing neither converges, {} and {}",
        (
            rate("pillow: finite_volume, one-norm, rate", 2),
            rate("pillow: cotan-6, one-norm, rate", 0.71),
            rate("jitter 5 %, finite_volume: one-norm, rate", 0),
            rate("jitter 5 %, cotan-6: one-norm, rate", 0),
        ),
        "reproduced only if ...",
    ),
]

LAST = [
    Claim(
        "5",
        "Exact for the line and the circle, second order on the ellipse",
        "line {} a point, circle on even spacing {}; ellipse rate {}; conditions under chapter 2",
        (
            below("line turn to 256", 12),
            below("circle error to 256", 11),
            rate("ellipse primal/dual points, rate", 2),
        ),
    ),
    Claim(
        "5",
        "Exact for the cylinder, second order in the one-norm on two grids of the sphere",
        "cylinder {}; rates {} (pillow) and {} (longitude-latitude)",
        (
            below("cylinder: largest error", 11),
            rate("pillow_sphere: one-norm rate", 2),
            rate("sphere: one-norm rate", 2),
        ),
    ),
    Claim(
        "abstract, 5",
        "An improvement upon the cotan formula on quadrilateral meshes",
        "one-norm of the error over that of cotan with valence 6, torus, 128 cells: {} on primal/dual "
        "points, but {} on the vertices of a grid",
        (
            near("torus, staggered: finite_volume over cotan-6", 0.211),
            near("torus, grid: finite_volume over cotan-6", 1.48),
        ),
        "reproduced only if ...",
    ),
    Claim(
        "5",
        "Given a complete mesh the scheme requires fewer calculations than Liu's formula",
        "as printed, each point on its own: {} operations against {}. Both have the same fluxes; computed "
        "once a quad they take {} against {}, Liu's area being the cheaper one",
        (
            exactly("operations: as printed, each cell on its own", 244),
            exactly("operations: Liu as printed", 384),
            exactly("operations: vertices", 80),
            exactly("operations: Liu, vertices", 61),
        ),
        "reproduced only if ...",
    ),
    Claim(
        "5",
        "On listings of faces Liu's formula needs no one-ring and takes triangles among the quads; with "
        "additional work so could the scheme",
        "its sums run over quads as well. H of a grid and of the same quads in random order differ by {}; "
        "with every third quad of an ellipsoid cut in two the one-norm of its error is {}, that of Liu's "
        "{}",
        (
            below("grid against shuffled faces", 10),
            near("mixed mesh, finite_volume", 5.6e-3),
            near("mixed mesh, liu", 0.048),
        ),
    ),
    Claim(
        "5",
        "Neither scheme has been proven to converge over such meshes",
        "neither does where the mesh is not smooth: with points moved by 5 % of the spacing the one-norm of "
        "the error stays, {} and {} at 128 cells, rates {} and {}",
        (
            near("jitter 5 %, finite_volume: one-norm, at 128", 0.0115),
            near("jitter 5 %, liu: one-norm, at 128", 0.0082),
            rate("jitter 5 %, finite_volume: one-norm, rate", 0),
            rate("jitter 5 %, liu: one-norm, rate", 0),
        ),
    ),
    Claim(
        "5",
        "Finite boundaries are an important issue that needs a method",
        "on the border of the hyperbolic-tangent sheet the open rings' error stays, {} at 256 cells, rate "
        "{}; with a layer of ghosts by quartic extrapolation it is {}, rate {}, inside {}",
        (
            near("border, tanh_sheet: none, at 256", 0.135),
            rate("border, tanh_sheet: none, rate", 0),
            near("border, tanh_sheet: package, at 256", 2.02e-5),
            rate("border, tanh_sheet: package, rate", 1.93, 0.1),
            near("border, tanh_sheet: inside, at 256", 8.75e-5),
        ),
    ),
]
CLAIMS = [*FIRST, *LAST]
