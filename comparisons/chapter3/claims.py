"""The claims of chapter 3, and what their numbers must be."""

from __future__ import annotations

import numpy as np

from comparisons.chapter3.measure import LARGE, TIMED
from comparisons.claims import Claim, Number, below, equal, exactly, near, rate, within


def orders(name: str, one: float, largest: float, first_order: bool = False) -> tuple[Number, ...]:
    """Rates in both norms and the errors at 256 cells."""
    return (
        rate(f"{name}: one-norm rate", 2, 0.03),
        rate(f"{name}: inf-norm rate", 1 if first_order else 2, 0.03),
        near(f"{name}: one-norm at 256", one),
        near(f"{name}: inf-norm at 256", largest),
    )


ORDERS = "rates {} (one-norm) and {} (inf-norm), errors {} and {} at 256 cells"

CLAIMS = [
    Claim(
        "3.3",
        "Second order or better on hyperboloids, paraboloids, hyperbolic-tangent sheets and cylinders",
        "inf-norm rates and errors at 256 cells: hyperboloid {}, {}; elliptic paraboloid {}, {}; hyperbolic "
        "paraboloid {}, {}; tanh sheet {}, {}; cylinder {}",
        (
            rate("hyperboloid: inf-norm rate", 2, 0.03),
            near("hyperboloid: inf-norm at 256", 3.83e-6),
            rate("elliptic_paraboloid: inf-norm rate", 2, 0.03),
            near("elliptic_paraboloid: inf-norm at 256", 6.16e-5),
            rate("hyperbolic_paraboloid: inf-norm rate", 2, 0.03),
            near("hyperbolic_paraboloid: inf-norm at 256", 1.66e-5),
            rate("tanh_sheet: inf-norm rate", 2, 0.03),
            near("tanh_sheet: inf-norm at 256", 3.56e-5),
            below("cylinder: largest error", 11),
        ),
    ),
    Claim(
        "3.3",
        "First order for piecewise smooth mappings",
        "in the inf-norm on the pillow sphere: rate {}, error {} at 256 cells",
        (rate("pillow_sphere: inf-norm rate", 1, 0.03), near("pillow_sphere: inf-norm at 256", 2.9e-3)),
    ),
    Claim(
        "3.3.1, (3.78), Figure 3.2",
        "Exact on the cylinder, whatever f(theta) shifts its rulings",
        "largest error {} with f = 0 and {} with f = sin 2 theta, up to 256 cells",
        (below("cylinder: largest error", 11), below("wavy cylinder: largest error", 11)),
    ),
    Claim("3.3.2", "Exact on the plane", "largest error {}", (below("plane: largest error", 12),)),
    Claim("3.3.2, Figure 3.4", "Second order on the catenoid", ORDERS, orders("catenoid", 1.56e-6, 2.53e-6)),
    Claim(
        "3.3.2, Figure 3.5",
        "Second order on the helicoid",
        f"for kappa = |H n| {ORDERS}; the signed -(H n) . n vanishes by symmetry, {{}}",
        (*orders("helicoid", 7.18e-7, 9.89e-7), below("helicoid: signed, inf-norm at 256", 10)),
    ),
    Claim(
        "3.3.2, Figure 3.7", "Second order on Enneper's surface", ORDERS, orders("enneper", 9.21e-7, 2.1e-6)
    ),
    Claim(
        "3.3.2, Figure 3.6",
        "The errors on Enneper's surface are centred on the origin and vanish outside of the area shown",
        "largest {} from the origin of the parameters, but on the edge of the figure still {} times the "
        "largest; they fall slowly, to {} times beyond a distance of 2.5",
        (
            near("enneper: where the largest error is", 0.62, 10),
            near("enneper: largest error on the figure's edge over all", 0.394),
            near("enneper: largest error beyond 2.5 over all", 0.023, 10),
        ),
        "reproduced only if ...",
    ),
    Claim(
        "3.3.2",
        "On Henneberg's surface the scheme fails to converge around the origin",
        "around the singular points (0, k pi/2) kappa stays {} off at 256 cells, rate {}; further than 0.25 "
        "from them its rate is {}, error {}; the signed H converges even there, rate {}",
        (
            near("henneberg: near, at 256", 0.0313),
            rate("henneberg: near, rate", 0),
            rate("henneberg: far, rate", 2, 0.1),
            near("henneberg: far, at 256", 1.28e-4),
            rate("henneberg: signed, rate", 1),
        ),
    ),
    Claim(
        "3.3.2",
        "because it is not continuous there and has no consistent normals",
        "mapping and unit normal are smooth there (on a circle of radius 0.001 the normal turns by {}); they "
        "are branch points: X_xi x X_eta vanishes and K is infinite",
        (near("henneberg: turn of the normal around a singular point", 0.002),),
        "slip",
    ),
    Claim(
        "3.3.3, Figure 3.9",
        "On the pillow sphere second order in the one-norm, first order in the inf-norm",
        ORDERS,
        orders("pillow_sphere", 1.48e-5, 2.9e-3, first_order=True),
    ),
    Claim(
        "3.3.3, Figure 3.8",
        "The errors of the pillow sphere sit on its seams, the equator and the diagonals",
        "at 128 cells the largest error off the seams is {} times that on them",
        (near("pillow: largest error off the seams over on them", 0.0131, 10),),
    ),
    Claim(
        "3.3.3",
        "The ratio of its largest to its smallest cell stays fixed under refinement",
        "{} at 32 and {} at 128 cells; longitude-latitude to the poles {} and {}",
        (
            near("pillow: largest over smallest cell, 32", 1.61, 1),
            near("pillow: largest over smallest cell, 128", 1.66, 1),
            near("sphere with poles: largest over smallest cell, 32", 20.4),
            near("sphere with poles: largest over smallest cell, 128", 81.5),
        ),
    ),
    Claim(
        "3.3.3, Figure 3.10",
        "Second order in spherical coordinates without the poles",
        ORDERS,
        orders("sphere", 9.7e-6, 1.83e-5),
    ),
    Claim(
        "3.3.3, Figures 3.8 and 3.11",
        "Overall the errors are greater in spherical coordinates than on the pillow grid",
        "to 80 degrees of latitude, with as many cells, the median error is {} times and the one-norm {} "
        "times that of the pillow grid (to 60 degrees {} times), but the inf-norm {} times",
        (
            near("sphere to 80 over pillow, median", 4.63),
            near("sphere to 80 over pillow, one-norm", 1.05),
            near("sphere to 60 over pillow, one-norm", 0.65),
            near("sphere to 80 over pillow, inf-norm", 0.018, 10),
        ),
        "reproduced only if ...",
    ),
    Claim(
        "3.3.3",
        "The exactness of the circle does not extend to the sphere",
        "errors at 256 cells: pillow grid {}, longitude-latitude {} (inf-norm)",
        (near("pillow_sphere: inf-norm at 256", 2.9e-3), near("sphere: inf-norm at 256", 1.83e-5)),
    ),
    Claim(
        "3.4, Figure 3.12",
        "The time is O(n^2)",
        f"processor time of one thread, less that of a call, grows with a power of n {{}} from {LARGE} to "
        f"{TIMED[-1]} cells in each direction; {{}} operations a cell",
        (within("time: exponent", 1.6, 2.4), exactly("operations: primal/dual", 102)),
    ),
    Claim(
        "3.4",
        "197 n^2 + C floating-point operations",
        "the printed formulas (3.24) to (3.34) take {} a cell on its own and {} if each edge is computed "
        "once; as a diamond scheme {}, on the vertices of a grid {}; {} of these counts are 197",
        (
            exactly("operations: as printed, each cell on its own", 244),
            exactly("operations: as printed, each edge once", 148),
            exactly("operations: primal/dual", 102),
            exactly("operations: vertices", 80),
            exactly("operations: counts that are 197", 0),
        ),
        "not reproduced",
    ),
    Claim(
        "3.4",
        "Each curvature depends on the eight surrounding points only",
        "moving points one by one, {} besides the cell's own change its H: four primal, four dual",
        (exactly("points that a cell's H depends on, itself not counted", 8),),
    ),
    Claim(
        "3.4",
        "so that ghost points make it easy to parallelize",
        "four blocks with a layer of ghosts each give the whole grid's H n to the last bit: difference {}",
        (exactly("blocks against the whole", 0),),
    ),
    Claim(
        "3.4",
        "which adds operations; every edge need be computed only once, some twice in parallel",
        "once instead of in each of its cells: {} operations instead of {}; four blocks of 256 x 256 cells "
        "compute {} % more edges",
        (
            exactly("operations: as printed, each edge once", 148),
            exactly("operations: as printed, each cell on its own", 244),
            near("edges of four blocks over those of the whole, in %", 0.39),
        ),
    ),
    Claim(
        "3.4",
        "On a GPU it is best to compute the edges at each point, since memory accesses decide",
        "{} bytes a cell if each cell computes its edges from points that are read once, {} if edges are "
        "written and read again; at {} operations a byte the former is still bound by memory, where "
        "processors for graphics do about ten a byte. Counted, not timed",
        (
            exactly("bytes: each cell on its own", 72),
            exactly("bytes: each edge once", 216),
            near("operations a byte: each cell on its own", 244 / 72, 1),
        ),
    ),
    Claim(
        "(3.20)",
        "The integral over the boundary is the sum of the four n_k",
        "without the lengths of the edges, which (3.21) has, the error on the torus is {} and {} (64 and 128 "
        "cells); with them {} and {}",
        (
            near("3.20: error at 64", 2.62),
            near("3.20: error at 128", 5.65),
            near("corrected: error at 64", 4.18e-4),
            near("corrected: error at 128", 1.05e-4),
        ),
        "slip",
    ),
    Claim(
        "(3.22)",
        "The surface normal is H/|H|",
        "undefined where H = 0: on the helicoid the computed H/|H| lies in the surface (cosine with the "
        "normal {}); on the sphere it points inward, {} along the outward normal",
        (
            below("3.22: largest cosine on the helicoid", 6),
            near("3.22: H n . outward normal on the sphere", -1),
        ),
        "slip",
    ),
    Claim(
        "(3.29)",
        "The edge normal is along a^11 t1 + a^22 t2",
        "on the torus its error stays at {} and {} (64 and 128 cells); with a^12 for a^22 it falls from "
        "{} to {}",
        (
            near("3.29: error at 64", 0.0694),
            near("3.29: error at 128", 0.0694),
            near("corrected: error at 64", 4.18e-4),
            near("corrected: error at 128", 1.05e-4),
        ),
        "slip",
    ),
    Claim(
        "(3.34), (3.35)",
        "t^(1) on all four edges",
        "on the torus its error stays at {} and {}; it is t^(1) or t^(2) as the edge runs",
        (near("3.34: error at 64", 0.317), near("3.34: error at 128", 0.317)),
        "slip",
    ),
    Claim(
        "(3.37)",
        "The third component of t_(1) is the difference of zeta",
        "zeta does not change along theta: {} times Delta Z, as the second line has it",
        (equal("3.37: printed over right", 0),),
        "slip",
    ),
    Claim(
        "(3.49)",
        "t^(2)_1 is negative",
        "the last term is {} times t^(2)_1 of (3.5); its first one, and (3.58), are right",
        (equal("3.49: printed over right", -1),),
        "slip",
    ),
    Claim(
        "(3.51)",
        "t^(2)_3 has sin(h/2) in its denominators",
        "squared: with h = 0.2 the terms are {} of what they should be; their sum is right, {}",
        (equal("3.51: printed over right", np.sin(0.1)), equal("3.51, the sum: printed over right", 1)),
        "slip",
    ),
    Claim(
        "(3.59)",
        "t^(2)_2 is positive",
        "{} times what (3.50) and (3.53) give: its minus is lost; the sum over two edges does not see it",
        (equal("3.59: printed over right", -1),),
        "slip",
    ),
    Claim(
        "(3.74)",
        "The difference of the sines at one angle",
        "is {} as printed; with the next angle in the first it is {}",
        (equal("3.74: left as printed", 0), near("3.74: left with the second angle", 0.15, 3)),
        "slip",
    ),
    Claim(
        "(3.79)",
        "The catenoid has Z = eta",
        "these points lie on the helicoid (3.80), {} off, and up to {} off the catenoid; with Z = xi {} off",
        (
            below("3.79: off the helicoid, Z = eta", 12),
            near("3.79: off the catenoid, Z = eta", 9.07),
            below("3.79: off the catenoid, Z = xi", 12),
        ),
        "slip",
    ),
]
