"""The claims of chapter 2, and what their numbers must be."""

from __future__ import annotations

from comparisons.claims import Claim, below, between, equal, near, rate

CLAIMS = [
    Claim(
        "2.1.2",
        "The curvature of a straight line is zero",
        "turns {} per point up to 256 points, its ends included: rounding",
        (below("line turn to 256", 12),),
    ),
    Claim(
        "2.1.3, (2.39) to (2.49)",
        "The circle is exact for any spacing",
        "error {} with steps that vary by half if dual points lie halfway between primal ones; {} with "
        "primal points halfway between dual ones; {} on even spacing, either way",
        (
            below("uneven, dual halfway, error at 256", 11),
            near("uneven, primal halfway, error at 256", 0.86),
            below("circle error to 256", 11),
        ),
        "reproduced only if ...",
    ),
    Claim(
        "2.1.4, Figure 2.3",
        "Second order on the ellipse",
        "rate {}, error {} at 256 points",
        (
            rate("ellipse primal/dual points, rate", 2),
            near("ellipse primal/dual points, error at 256", 4.92e-4),
        ),
    ),
    Claim(
        "2.1.5, Figure 2.5",
        "Nearly fourth order on the Euler spiral; under-resolved at first",
        "rate {}, error {} at 8192 points; {} at 512",
        (
            rate("spiral rate", 4, 0.1),
            near("spiral error at 8192", 1.45e-9),
            between("spiral error at 512", 1e3, 1e5),
        ),
    ),
    Claim(
        "2.1.5",
        "Since the spiral is locally a circle, where terms cancel",
        "the second-order term is kappa'' where points are even in arc length, and kappa = 2t has none; on "
        "steps that vary slowly the rate is {}",
        (rate("spiral rate on steps that vary slowly", 2, 0.1),),
        "reproduced only if ...",
    ),
    Claim(
        "2.1.5, Figure 2.5",
        "The last error deviates due to the precision of the Fresnel integrals",
        "at 32768 points the error is {} eps/h^2 with scipy's integrals, {} with correctly rounded ones, "
        "where positions are rounded alone, and {} with positions that are not rounded: precise integrals "
        "lower it, rounded positions bound it",
        (
            between("spiral, computed, at 32768 over eps/h^2", 2.5, 8, ".1f"),
            between("spiral, rounded, at 32768 over eps/h^2", 1.1, 2.2, ".1f"),
            between("spiral, exact, at 32768 over eps/h^2", 0.3, 1.2, ".1f"),
        ),
        "reproduced only if ...",
    ),
    Claim(
        "2.2, Figure 2.7",
        "Second order for curvature and torsion on the helix",
        "rates {} and {}, errors {} and {} at 256 points; the printed (2.54) to (2.56), corrected, have {}",
        (
            rate("helix curvature, rate", 2),
            rate("helix torsion, rate", 2),
            near("helix curvature, error at 256", 3.23e-5),
            near("helix torsion, error at 256", 2.43e-5),
            near("helix printed torsion, error at 256", 2.43e-5),
        ),
    ),
    Claim(
        "2.2",
        "The exactness of the circle does not extend to curves with torsion",
        "on the helix the curvature is {} off at 256 points, on the circle {}",
        (near("helix curvature, error at 256", 3.23e-5), below("circle error to 256", 11)),
    ),
    Claim(
        "2.2, (2.54) to (2.56)",
        "Torsion from the difference of two normals over one edge",
        "on steps that vary by half its error stays, {} at 256 points; over a third of three edges it is {}, "
        "rate {}, and the sign comes with it: {} on a left-handed helix",
        (
            near("uneven, printed torsion, error at 256", 0.317, 10),
            near("uneven, torsion, error at 256", 6.6e-5, 10),
            rate("uneven, torsion, rate", 2, 0.2),
            near("torsion of the left-handed helix", -0.4, 1),
        ),
        "reproduced only if ...",
    ),
    Claim(
        "(2.31)",
        "The surface normal is the unit edge vector t_(1)/|t_(1)|",
        "that is the tangent: its cosine with H/|H| is at most {}; n_s = H/|H| (2.23)",
        (near("2.31 largest cosine of printed and exact normal", 0.022),),
        "slip",
    ),
    Claim(
        "(2.39)",
        "The second line is the length of the edge",
        "it is {} times the length squared, the root is missing; the last line is {} times the length",
        (
            equal("2.39 second line over the chord squared", 1),
            equal("2.39 last line over the chord", 1),
        ),
        "slip",
    ),
    Claim(
        "(2.45)",
        "H of the circle points along (cos, -sin)",
        "along (-cos, -sin): H = {} along x at t = 0; the sign of (2.44) is lost, its norm is right",
        (equal("2.45 x component of H at t = 0", -1),),
        "slip",
    ),
    Claim(
        "(2.48)",
        "(h_j + h_(j-1))/2 = h_j^d since primal points are halfway between dual ones",
        "with cells of widths 1, 2, 1 the left is {} times the right, with widths 1, 2, 3 {} times; it holds "
        "for dual points halfway between primal ones",
        (
            equal("2.48 left over right where widths jump", 0.75),
            equal("2.48 left over right where widths grow linearly", 1),
        ),
        "slip",
    ),
    Claim(
        "(2.54)",
        "dn/ds divides by |t^(1)|",
        "gives tau = {}, the curvature; divided by the primal spacing |t_(1)| {}, exact 0.4",
        (
            near("2.54 printed torsion of the helix", 0.798, 0.5, ".3f"),
            near("2.54 corrected torsion of the helix", 0.4, 0.05, ".4f"),
        ),
        "slip",
    ),
]
