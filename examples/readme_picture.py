"""The picture that opens the README: errors of four operators on a sphere with folds in its grid."""

from pathlib import Path

from PIL import Image

from quadcurv import surfaces
from quadcurv.comparison import Comparison, compare
from quadcurv.viewing import save_maps


def pillow(cells: int = 40) -> Comparison:
    """Compare operators on the pillow sphere, whose grid lines kink along the edges of two squares."""
    surface = surfaces.pillow_sphere()
    mesh, xi, eta = surface.sample((2 * cells, cells), "staggered")
    return compare(mesh, ["finite_volume", "liu", "cotan-6", "cotan-8"], surface.mean_curvature(xi, eta))


def picture(path: Path) -> None:
    """Save the errors in 256 colours, a quarter of the size."""
    save_maps(pillow(), path, "error")
    with Image.open(path) as image:
        small = image.convert("RGB").resize((1600, 520), Image.Resampling.LANCZOS)
    palette = small.quantize(256, Image.Quantize.MAXCOVERAGE)
    small.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG).save(path, optimize=True)


def main() -> float:
    """Return how many times the largest error of finite volumes that of cotan on valence 6 is."""
    errors = pillow().norms()
    return errors["cotan-6"]["inf"] / errors["finite_volume"]["inf"]


if __name__ == "__main__":
    picture(Path(__file__).with_name("readme.png"))
    print(f"largest error of cotan-6 over that of finite_volume: {main():.0f}")
