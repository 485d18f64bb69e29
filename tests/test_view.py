"""Maps as pictures, scenes of pyvista with maps in them, figures of convergence."""

from __future__ import annotations

import os
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import pyvista
from maps import is_like, made_up, needs_opengl, on_ellipsoid, on_pillow, pixels
from PIL import Image

from quadcurv import surfaces, viewing
from quadcurv.comparison import compare
from quadcurv.refinement import convergence
from quadcurv.viewing import opengl
from quadcurv.viewing.geometry import OVERLAYS
from quadcurv.viewing.scale import NAN_COLOUR, ZERO_COLOUR

IMAGES = Path(__file__).parent / "images"
GL_LIBRARIES = [
    f"lib{name}.so{version}"
    for name in ("GL", "GLX", "EGL", "OpenGL", "OSMesa")
    for version in ("", ".0", ".1", ".8")
]


@pytest.fixture(scope="module")
def pillow():
    return on_pillow()


@pytest.fixture(scope="module")
def ellipsoid():
    return on_ellipsoid()


@needs_opengl
@pytest.mark.parametrize("field", ["mean_curvature", "error"])
def test_picture_is_the_one_kept(pillow, ellipsoid, tmp_path, field):
    comparison = {"mean_curvature": ellipsoid, "error": pillow}[field]
    viewing.save_maps(comparison, tmp_path / "map.png", field)
    kept = IMAGES / f"{field}.png"
    if os.environ.get("QUADCURV_KEEP_IMAGES"):
        with Image.open(tmp_path / "map.png") as image:
            half = image.convert("RGB").resize((image.width // 2, image.height // 2))
        half.quantize(255, dither=Image.Dither.NONE).save(kept, optimize=True)
    reference = pixels(kept)
    size = reference.shape[1::-1]
    assert is_like(pixels(tmp_path / "map.png", size), reference)
    viewing.save_maps(comparison, tmp_path / "other.png", "signed_error")
    assert not is_like(pixels(tmp_path / "other.png", size), reference)  # the tolerance tells maps apart


@needs_opengl
def test_picture_shows_nan_and_zero_in_their_colours(tmp_path):
    H = np.full(40, 1e-2)
    H[:16], H[-16:] = 0.0, np.nan
    viewing.save_maps(made_up(a=H), tmp_path / "map.png")
    assert grey(tmp_path / "map.png").mean() > 0.007
    assert grey(tmp_path / "map.png")[-180:].any(axis=0).mean() > 0.05  # its patch in the legend
    viewing.save_maps(made_up(a=np.linspace(1e-3, 1e-2, 40)), tmp_path / "map.png")
    assert grey(tmp_path / "map.png").mean() < 0.002  # smoothed letters


def grey(path):
    return (pixels(path) == [0xB0] * 3).all(axis=2)


@needs_opengl
def test_views_share_one_camera(ellipsoid):
    plotter = viewing.maps(ellipsoid)
    assert len({id(r.camera) for r in plotter.renderers[:3]}) == 1
    plotter.close()


@pytest.mark.parametrize("name", ["map.jpg", "map"])
def test_unknown_suffix(pillow, tmp_path, name):
    with pytest.raises(ValueError, match=r"path: expected a name ending in \.png or \.html, got map"):
        viewing.save_maps(pillow, tmp_path / name)


@needs_opengl
def test_plot_is_the_scene_of_the_maps(ellipsoid):
    plotter = viewing.maps(ellipsoid, "signed_error")
    plotter.show(auto_close=False)
    surfaces_shown = [r.actors["surface"].mapper.dataset for r in plotter.renderers[:3]]
    for shown, errors in zip(surfaces_shown, ellipsoid.errors.values(), strict=True):
        np.testing.assert_array_equal(shown["values"], errors)
    plotter.close()


def drawn_views(view):
    """Titles of what is seen."""
    return [r.actors["title"].input for r in view.plotter.renderers if r.GetDraw() and seen(r)]


def seen(renderer):
    return "surface" in renderer.actors and renderer.actors["surface"].visibility


@needs_opengl
def test_a_field_takes_as_many_views_as_it_has(ellipsoid):
    view = viewing.View(ellipsoid, off_screen=True)
    assert view.views == drawn_views(view) == ["finite_volume", "liu", "cotan-6"]
    for what in ("normals", "directions", "histogram", "overlays"):
        view.toggle(what)
    zoom = view.plotter.renderers[0].camera.parallel_scale
    view.show_field("valence")
    assert view.views == drawn_views(view) == ["valence"]
    assert tuple(view.plotter.renderers[0].viewport)[::2] == (0, 1)  # across the whole window
    assert view.plotter.renderers[0].actors["surface"].mapper.dataset["values"].tolist() == (
        ellipsoid.valence.tolist()
    )
    view.show_field("difference to liu")
    assert view.views == drawn_views(view) == ["finite_volume", "cotan-6"]
    view.show_field("mean_curvature")
    assert view.views == drawn_views(view) == ["finite_volume", "liu", "cotan-6"]
    assert view.plotter.renderers[0].camera.parallel_scale == pytest.approx(zoom)
    view.plotter.close()


@needs_opengl
def test_places_without_a_view_are_white(tmp_path):
    ball = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    found = compare(ball, ["liu", "jet", "cotan-6", "bunge", "bilinear"])
    viewing.save_maps(found, tmp_path / "five.png", "mean_curvature")
    assert (pixels(tmp_path / "five.png").max(axis=2) > 60).mean() > 0.97  # but for letters and lines


@needs_opengl
def test_legend_of_two_views_has_room_for_all_marks(monkeypatch):
    """Six patches, all of them whole, right of the colour bar."""
    H = np.full(40, 1e-2)
    H[:8], H[-8:] = 0.0, np.nan
    view = viewing.View(made_up(a=H, b=H), "error", off_screen=True)
    marks = {"boundary": np.array([[0, 1]]), "seam": np.array([[2, 3]])}
    marks |= {"valence < 4": np.array([3]), "valence > 4": np.array([5])}
    monkeypatch.setattr(type(view._fields), "overlays", marks)
    view.toggle("overlays")
    picture = np.asarray(view.plotter.screenshot(return_img=True), float)[-180:, 700:]
    for colour in [*OVERLAYS.values(), ZERO_COLOUR, NAN_COLOUR]:
        here = (np.abs(picture - pyvista.Color(colour).int_rgb) <= 1).all(axis=2)
        assert here.sum() > 900, colour
    view.plotter.close()


@needs_opengl
def test_error_map_in_a_scene_of_ones_own():
    surface = surfaces.torus()
    mesh, xi, eta = surface.sample((12, 12), "staggered")
    exact = surface.mean_curvature(xi, eta)
    plotter = pyvista.Plotter(off_screen=True)
    actor = plotter.quadcurv.add_error_map(mesh, exact, "liu", name="mine")
    assert plotter.actors["mine"] is actor
    found = actor.mapper.dataset.cell_data["log10 error"]
    np.testing.assert_allclose(10**found, np.abs(compare(mesh, ["liu"], exact).errors["liu"]).ravel())
    low, high = actor.mapper.scalar_range
    assert (low % 1, high % 1) == (0, 0)
    assert low <= found.min() < found.max() <= high
    other = plotter.quadcurv.add_error_map(mesh, exact, limits=(1e-6, 1e1))
    assert other.mapper.scalar_range == (-6, 1)
    assert list(plotter.scalar_bars.keys()) == ["error in H, liu\n", "error in H, jet\n"]
    with pytest.raises(ValueError, match=r"limits: expected 0 < low < high, got \(1, 0.1\)"):
        plotter.quadcurv.add_error_map(mesh, exact, limits=(1, 0.1))
    plotter.close()


@needs_opengl
def test_error_map_shows_exact_zero():
    grid = surfaces.plane().sample((6, 6))[0]
    plotter = pyvista.Plotter(off_screen=True)
    actor = plotter.quadcurv.add_error_map(grid, 0.0)
    assert (actor.mapper.dataset["log10 error"] < actor.mapper.scalar_range[0]).all()
    assert actor.mapper.lookup_table.below_range_color == pyvista.Color(ZERO_COLOUR)
    plotter.close()


def test_figure_of_convergence():
    found = convergence(surfaces.torus(), ["finite_volume", "liu"], [8, 16, 32])
    figure = viewing.plot(found)
    for axes, norm in zip(figure.axes, ("one", "inf"), strict=True):
        for line, scheme in zip(axes.lines, found.schemes, strict=True):
            np.testing.assert_allclose(line.get_xdata(), [8, 16, 32])
            np.testing.assert_array_equal(line.get_ydata(), found.errors[scheme][norm])
            assert line.get_label() == f"{scheme}: {found.fitted_rate(scheme, norm):.2f}"
        assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
        assert "(1/length)" in axes.get_ylabel()
    exact = convergence(surfaces.cylinder(), ["finite_volume"], [8, 16])
    assert viewing.plot(exact, ["two"]).axes[0].lines[0].get_label() == "finite_volume: exact"
    with pytest.raises(ValueError, match=r"norms: expected any of one, two, .*, got \['three'\]"):
        viewing.plot(found, ["three"])


def test_figure_leaves_out_exact_zeros_and_can_be_saved(tmp_path):
    found = convergence(surfaces.plane(), ["liu", "finite_volume"], [6, 12], "grid")
    figure = viewing.plot(found)
    assert np.isnan(figure.axes[0].lines[0].get_ydata()).all()
    figure.savefig(tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 5000
    with Image.open(BytesIO(figure._repr_png_())) as image:  # what a notebook shows
        assert image.width > image.height > 400


@pytest.fixture
def without_opengl(tmp_path):
    """Environment of a machine without OpenGL: the loader finds empty files of these names first."""
    if sys.platform != "linux":
        pytest.skip("libraries are hidden the way of Linux")
    folder = tmp_path / "empty_libraries"
    folder.mkdir()
    for name in GL_LIBRARIES:
        (folder / name).touch()
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
    return environment | {"LD_LIBRARY_PATH": str(folder)}


def test_without_opengl_pages_are_written_and_pictures_refused(without_opengl, tmp_path):
    code = """
from quadcurv import surfaces, viewing
from quadcurv.comparison import compare
found = compare(surfaces.torus().sample((6, 6), "faces")[0], ["liu"])
viewing.save_maps(found, "map.html")
try:
    viewing.save_maps(found, "map.png")
except viewing.NoOpenGLError as error:
    print(error)
"""
    run = subprocess.run(
        [sys.executable, "-c", code],
        env=without_opengl,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "libgl1, libegl1 and libopengl0" in run.stdout
    assert run.stderr == ""
    assert "</html>" in (tmp_path / "map.html").read_text()
    assert not (tmp_path / "map.png").exists()


def test_without_a_display_no_window_is_opened(monkeypatch, pillow):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(viewing.NoOpenGLError, match="no display"):
        viewing.view(pillow)


def test_the_probe_runs_nothing_of_the_current_folder(tmp_path, monkeypatch):
    (tmp_path / "pyvista.py").write_text("open('was_run', 'w').close()")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend("")
    opengl.opengl_problem.__wrapped__()
    assert not (tmp_path / "was_run").exists()


def test_a_probe_that_hangs_is_told_of(monkeypatch):
    monkeypatch.setattr(opengl, "_SECONDS", 0.01)
    assert opengl.opengl_problem.__wrapped__() == "OpenGL gives no picture within 0.01 seconds"


def test_style_refuses_what_it_cannot_be():
    for wrong, message in (
        ({"camera": (0, 0, 0)}, r"camera: expected a direction, got \(0, 0, 0\)"),
        ({"camera": (1, np.nan, 0)}, "camera: expected 3 finite numbers"),
        ({"camera": "top"}, "camera: expected 3 finite numbers"),
        ({"size": (99, 200)}, "size: expected whole numbers of pixels, at least 100"),
        ({"size": (300.5, 200)}, "size: expected whole numbers of pixels, at least 100"),
        ({"size": 300}, "size: expected 2 finite numbers"),
        ({"limits": (2, 1)}, "limits: expected low < high"),
        ({"limits": (0, np.inf)}, "limits: expected 2 finite numbers"),
        ({"colours": "plaid"}, "colours: matplotlib has no map 'plaid'"),
        ({"title": "a\nb"}, "title: expected one line"),
    ):
        with pytest.raises(ValueError, match=message):
            viewing.Style(**wrong)


def test_limits_are_checked_before_anything_is_drawn(ellipsoid):
    with pytest.raises(ValueError, match="limits: expected 0 < low < high"):
        viewing.maps(ellipsoid, "error", viewing.Style(limits=(-1, 1)))


@needs_opengl
def test_style_of_a_picture(ellipsoid, tmp_path):
    style = {"size": (900, 500), "camera": (0, 0, 1)}
    viewing.save_maps(ellipsoid, tmp_path / "plain.png", "error", viewing.Style(**style))
    plain = pixels(tmp_path / "plain.png")
    assert plain.shape == (500, 900, 3)
    seen = (plain != 255).any(axis=2)
    across, up = np.ptp(ellipsoid.mesh.points, axis=0)[:2]
    columns, rows = (
        np.flatnonzero(seen[60:380, :300].any(axis=0)),
        np.flatnonzero(seen[60:380, :300].any(axis=1)),
    )
    assert np.ptp(columns) / np.ptp(rows) == pytest.approx(across / up, rel=0.03)  # from above, not squeezed
    viewing.save_maps(
        ellipsoid, tmp_path / "titled.png", "error", viewing.Style(title="Three operators", **style)
    )
    titled = pixels(tmp_path / "titled.png")
    dark = (titled < 100).all(axis=2)
    assert dark[:40, 300:600].sum() > 50  # above the middle view, as wide as the title
    assert not (plain[:8] < 100).any()


@needs_opengl
def test_limits_colours_and_shading_of_the_first_field(ellipsoid):
    style = viewing.Style(limits=(1e-3, 1.0), colours="magma", shading=True)
    view = viewing.View(ellipsoid, "error", style, off_screen=True)
    mapper = view.plotter.renderers[0].actors["surface"].mapper
    assert mapper.scalar_range == (-3, 0)
    bright = tuple(mapper.lookup_table.map_value(-0.01)[:3])
    assert bright == pytest.approx(pyvista.LookupTable("magma", scalar_range=(-3, 0)).map_value(-0.01)[:3])
    assert view.plotter.renderers[0].actors["surface"].prop.lighting
    np.testing.assert_allclose(
        10 ** mapper.dataset["values"], np.clip(np.abs(ellipsoid.errors["finite_volume"]), 1e-3, None)
    )
    view.show_field("mean_curvature")
    low, high = view.plotter.renderers[0].actors["surface"].mapper.scalar_range
    assert low == -high
    view.plotter.close()


@needs_opengl
def test_a_mesh_is_shown_with_its_curvature():
    mesh = surfaces.cubed_sphere().sample((6, 6), "faces")[0]
    plotter = viewing.maps((mesh.points, mesh.faces), "mean_curvature")
    shown = plotter.renderers[0].actors["surface"].mapper.dataset["values"]
    assert shown == pytest.approx(1, abs=0.05)
    plotter.close()


@needs_opengl
@pytest.mark.parametrize("decades", [None, (-5, -1)])
def test_figure_of_several_surfaces(decades, tmp_path):
    mesh = surfaces.torus().sample((12, 9), "staggered")[0]
    panels = {"cells": (mesh, np.logspace(-6, 0, 108).reshape(12, 9)), "b": (mesh, np.full((12, 9), np.nan))}
    figure = viewing.surfaces_figure(panels, "error", decades)
    assert [axes.get_title() for axes in figure.axes[:2]] == ["cells", "b"]
    assert len(figure.axes) == 2 + (decades is not None)
    figure.savefig(tmp_path / "figure.png", dpi=100)
    picture = pixels(tmp_path / "figure.png")
    assert (picture == [0xB0] * 3).all(axis=2).mean() > (0.01 if decades else -1)


def test_no_figure_of_surfaces_without_opengl(monkeypatch):
    from quadcurv.viewing import panels

    monkeypatch.setattr(panels, "opengl_problem", lambda: "no usable OpenGL")
    with pytest.raises(viewing.NoOpenGLError, match="no usable OpenGL"):
        viewing.surfaces_figure({})
