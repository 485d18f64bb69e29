"""Pictures of a gallery script as sphinx-gallery wants them, and the order of the scripts."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from PIL import Image
from pyvista.plotting import plotter as plotters
from sphinx_gallery.scrapers import figure_rst

ORDER = (
    "cubed_sphere",
    "terrain_with_holes",
    "cad_fillet",
    "blocks_that_meet",
    "subdivision_surface",
    "minimal_surfaces",
    "one_operator_two_areas",
    "noisy_scan",
    "damaged_mesh",
    "surface_of_ones_own",
    "functions_on_surfaces",
    "eigenmodes",
    "mean_curvature_flow",
    "moving_grid",
    "membrane_in_time",
    "other_programs",
    "pyvista_accessor",
    "trimesh_curvature",
    "meshlab_smoothing",
    "triangles_to_grid",
)

_MARGIN = 20  # pixels
_WIDTH = 1400  # pixels, beyond which nobody sees more


class Pictures:
    """A scraper: writes the scenes of pyvista, and the figures of matplotlib, that a block has made."""

    def __init__(self):
        self._seen = []

    def __repr__(self):
        return "Pictures"

    def __call__(self, block, block_vars, gallery_conf):
        paths = []
        for scene in list(plotters._ALL_PLOTTERS.values()):
            paths.append(next(block_vars["image_path_iterator"]))
            _save(scene.screenshot(return_img=True), paths[-1])
            scene.close()
        plotters._ALL_PLOTTERS.clear()
        for value in block_vars["example_globals"].values():
            if not isinstance(value, Figure) or any(value is figure for figure in self._seen):
                continue
            self._seen.append(value)
            if getattr(value, "number", None) not in plt.get_fignums():  # which matplotlib's scraper sees to
                paths.append(next(block_vars["image_path_iterator"]))
                value.savefig(paths[-1], dpi=150, bbox_inches="tight")
        return figure_rst(paths, gallery_conf["src_dir"])


def _save(image, path):
    """Write in 256 colours, a quarter of the size, without the empty margin."""
    painted = (image != image[0, 0]).any(axis=2)
    rows, columns = (np.flatnonzero(painted.any(axis=axis)) for axis in (1, 0))
    top, left = (max(places[0] - _MARGIN, 0) for places in (rows, columns))
    picture = Image.fromarray(image[top : rows[-1] + _MARGIN, left : columns[-1] + _MARGIN])
    if picture.width > _WIDTH:
        height = round(picture.height * _WIDTH / picture.width)
        picture = picture.resize((_WIDTH, height), Image.Resampling.LANCZOS)
    palette = picture.quantize(256, Image.Quantize.MAXCOVERAGE)
    colours = np.array(palette.getpalette(), np.uint8).reshape(-1, 3)
    colours[colours.min(axis=1).argmax()] = 255  # the page is white, and so is the picture around its subject
    palette.putpalette(colours.tobytes())
    picture.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG).save(path, optimize=True)
