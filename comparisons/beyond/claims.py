"""Findings beyond the thesis, and what their numbers must be."""

from __future__ import annotations

from comparisons.claims import Claim, Number, below, between, near, rate


def border(surface: str, treatment: str, error: float, order: float) -> tuple[Number, Number]:
    """Largest error on the border, or inside, at 256 cells, and its rate."""
    key = f"border, {surface}: {treatment}"
    return near(f"{key}, at 256", error, 5), rate(f"{key}, rate", order, 0.1)


def jittered(scheme: str, values: tuple[float, ...]) -> tuple[Number, ...]:
    """One-norm of the error at 128 cells with 0, 5, 10 and 20 % of jitter."""
    return tuple(
        near(f"jitter {jitter} %, {scheme}: one-norm, at 128", value, 10)
        for jitter, value in zip((0, 5, 10, 20), values, strict=True)
    )


def largest(mesh: str, scheme: str, valence: int, order: float) -> Number:
    """Rate of the largest error at vertices of a valence."""
    return rate(f"{mesh}, {scheme}: valence {valence}, largest, rate", order, 0.1)


def area(surface: str, layout: str, scheme: str, value: float) -> Number:
    """Error of a cotan scheme at 128 cells where it does not converge."""
    return near(f"areas, {surface}, {layout}, {scheme}: at 128", value, 3)


CUBE, BALL = "cubed ellipsoid", "icosahedral sphere"
RATED = "{} (rate {})"
EIGHT, VORONOI = "cotan-8", "cotan-8-voronoi"

CLAIMS = [
    Claim(
        "beyond_boundaries.png",
        "What does an open boundary need?",
        "Quartic ghosts. Largest error of H on the border of the hyperbolic-tangent sheet at 256 cells: none "
        f"{RATED}; quadratic ghosts {RATED}; cubic ghosts {RATED}; quartic ghosts {RATED}; as the "
        f"package closes it {RATED}; inside {RATED}. On the catenoid: none {RATED}; quadratic {RATED}; "
        f"cubic {RATED}; quartic {RATED}; package {RATED}; inside {RATED}. Where the surface is a "
        "polynomial of degree 2 all ghosts are the same.",
        (
            *border("tanh_sheet", "none", 0.135, 0),
            *border("tanh_sheet", "quadratic ghosts", 3.83e-3, 1),
            *border("tanh_sheet", "cubic ghosts", 9.55e-5, 2),
            *border("tanh_sheet", "quartic ghosts", 2.02e-5, 1.93),
            *border("tanh_sheet", "package", 2.02e-5, 1.93),
            *border("tanh_sheet", "inside", 8.75e-5, 2),
            *border("catenoid", "none", 0.204, 0),
            *border("catenoid", "quadratic ghosts", 1.25e-3, 1),
            *border("catenoid", "cubic ghosts", 2.55e-5, 2),
            *border("catenoid", "quartic ghosts", 1.29e-5, 2),
            *border("catenoid", "package", 1.29e-5, 2),
            *border("catenoid", "inside", 7.28e-5, 2),
        ),
        "holds",
    ),
    Claim(
        "beyond_extraordinary.png",
        "What happens at extraordinary vertices?",
        "The finite-volume scheme is first order there: rates {} at valence 3 of the cubed ellipsoid "
        "(error {} at 32 cells a panel), {} at valence 3 and {} at valence 5 of the icosahedral sphere, "
        "as along the seams between panels, {}; the mean error is second order, {}. Liu's formula: {} at "
        "valence 3 of the cubed ellipsoid (error {}), exact at the symmetric vertices of the spheres, {} "
        "and {}. Cotan with valence 6 does not converge at valence 3 of the cubed ellipsoid (error {}, "
        "rate {}) nor at valence 5 ({}, {}).",
        (
            largest(CUBE, "finite_volume", 3, 1.05),
            near(f"{CUBE}, finite_volume: valence 3, largest, at 32", 0.0198),
            largest(BALL, "finite_volume", 3, 1),
            largest(BALL, "finite_volume", 5, 1.21),
            largest(BALL, "finite_volume", 4, 0.93),
            rate(f"{BALL}, finite_volume: all, mean, rate", 2, 0.05),
            largest(CUBE, "liu", 3, 0.81),
            near(f"{CUBE}, liu: valence 3, largest, at 32", 1.3e-3),
            below(f"{BALL}, liu: valence 3, largest, at 32", 10),
            below(f"{BALL}, liu: valence 5, largest, at 32", 10),
            near(f"{CUBE}, cotan-6: valence 3, largest, at 32", 0.713),
            largest(CUBE, "cotan-6", 3, -0.05),
            near(f"{BALL}, cotan-6: valence 5, largest, at 32", 0.582),
            largest(BALL, "cotan-6", 5, 0),
        ),
        "holds",
    ),
    Claim(
        "beyond_jitter.png",
        "What does a grid that is not smooth do?",
        "Finite volume, Liu and cotan stop converging; fitted jets do not. One-norm of the error of H on "
        "a torus of 128 x 128 points moved within the surface by up to 0 / 5 / 10 / 20 % of the spacing: "
        "finite volume {} / {} / {} / {}; Liu {} / {} / {} / {}; cotan 6 {} / {} / {} / {} (rates at 20 "
        "%: {}, {} and {}). Jets at 20 %: of degree 2 rate {}, the default rate {}, error {}.",
        (
            *jittered("finite_volume", (2.21e-4, 1.15e-2, 2.33e-2, 4.83e-2)),
            *jittered("liu", (1.42e-4, 8.22e-3, 1.67e-2, 3.6e-2)),
            *jittered("cotan-6", (1.49e-4, 5.81e-3, 1.24e-2, 3.1e-2)),
            *(
                rate(f"jitter 20 %, {scheme}: one-norm, rate", 0, 0.05)
                for scheme in ("finite_volume", "liu", "cotan-6")
            ),
            between("jitter 20 %, jet-2: one-norm, rate", 0.9, 2.1, ".1f"),
            between("jitter 20 %, jet: one-norm, rate", 4.0, 6.2, ".1f"),
            between("jitter 20 %, jet: one-norm, at 128", 2e-7, 3e-6),
        ),
        "holds",
    ),
    Claim(
        "beyond_valence_8.png",
        "Why does valence 8 fail?",
        "On the vertices of an orthogonal grid because of its area: its fluxes are those of the "
        "five-point Laplacian, but a third of the ring is {} times the Voronoi area (valence 4: {} "
        "times). Errors at 128 cells on cylinder, torus and longitude-latitude sphere with barycentric "
        "areas: {}, {}, {}; with Voronoi areas on the cylinder {}, on the others rates {} and {}. On the "
        "non-orthogonal grid of the paraboloid it fails with either, {} and {}, and so it does on "
        "primal/dual points of the torus and the sphere, {} and {}, where the sides of the stencil's "
        "quads are not orthogonal.",
        (
            near("areas: barycentric over Voronoi, valence 8", 4 / 3, 1),
            near("areas: barycentric over Voronoi, valence 4", 2 / 3, 1),
            area("cylinder", "grid", EIGHT, 0.125),
            area("torus", "grid", EIGHT, 0.106),
            area("sphere", "grid", EIGHT, 0.25),
            below(f"areas, cylinder, grid, {VORONOI}: at 128", 10),
            rate(f"areas, torus, grid, {VORONOI}: rate", 0.95, 0.1),
            rate(f"areas, sphere, grid, {VORONOI}: rate", 1, 0.1),
            area("elliptic_paraboloid", "grid", EIGHT, 0.2),
            area("elliptic_paraboloid", "grid", VORONOI, 0.0809),
            area("torus", "staggered", VORONOI, 0.18),
            area("sphere", "staggered", VORONOI, 1.11),
        ),
        "holds",
    ),
]
