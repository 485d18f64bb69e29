"""The commands: options are checked first, then files read, and only then anything computed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter
from rich.console import Console

from quadcurv import viewing
from quadcurv.cli.arrays import curvature_of_array
from quadcurv.cli.inputs import Input, load
from quadcurv.cli.options import (
    MeshOptions,
    PictureOptions,
    Schemes,
    check_field,
    check_file,
    check_folder,
    check_schemes,
)
from quadcurv.cli.say import say
from quadcurv.cli.values import Value, values, values_of
from quadcurv.comparison import Comparison
from quadcurv.comparison import compare as compared
from quadcurv.extras import missing, need
from quadcurv.io import write
from quadcurv.io.base import FORMATS, STORES
from quadcurv.mesh import Mesh
from quadcurv.mesh_quality import summary
from quadcurv.schemes import SCHEMES
from quadcurv.surfaces import SURFACES
from quadcurv.tables import write_csv
from quadcurv.viewing import FIELDS, Style

_PLAIN_MESH, _PLAIN_PICTURE = MeshOptions(), PictureOptions()


def compare(
    mesh: Path,
    /,
    *,
    scheme: Schemes = None,
    output: Annotated[Path | None, Parameter(("--output", "-o"))] = None,
    csv_file: Annotated[Path | None, Parameter("--csv")] = None,
    as_json: Annotated[bool, Parameter("--json", negative="")] = False,
    options: MeshOptions = _PLAIN_MESH,
    picture: PictureOptions = _PLAIN_PICTURE,
) -> None:
    """Mean curvature of a mesh by several schemes: tables and pictures.

    First come what was mended in the mesh, and counts of faces, valences and boundary. Schemes are compared
    with their median at each vertex, by valence and in pairs. Two pictures, one view a scheme, show the mean
    curvature and the disagreement: PNG, or a page in HTML where nothing can render.

    **Examples**

        quadcurv compare spot.obj
        quadcurv compare spot.obj -s finite_volume -s liu -s cotan-6 -o pictures --camera 1 0 0
        quadcurv compare spot.obj --json | jq .differences

    Parameters
    ----------
    mesh
        File of a mesh of quads, or of quads and other polygons.
    output
        Folder for the pictures; by default quadcurv-output, and none are made with --json.
    csv_file
        File for the norms by scheme and valence.
    as_json
        Print numbers as JSON instead of tables.
    """
    check_schemes(scheme)
    style = picture.style()
    check_file(csv_file, "--csv")
    problem = missing("matplotlib")
    if output is None and not as_json:
        if problem:
            say(f"no pictures: {problem}")
        else:
            output = Path("quadcurv-output")
    elif output is not None and problem:
        raise ImportError(problem)
    check_folder(output, "--output")
    found = load(mesh, options)
    comparison = compared(found.mesh, scheme, boundary=options.boundary)
    if as_json:
        print(json.dumps({"mesh": str(found.mesh.report), **comparison.to_dict()}, indent=2))
    else:
        print(_counts(found.mesh, options.boundary))
        Console().print(comparison)
    if csv_file is not None:
        comparison.to_csv(csv_file)
        say(csv_file)
    if output is not None:
        _save_pictures(comparison, output, mesh.stem, style)


def curvature(
    mesh: Path,
    /,
    *,
    output: Annotated[Path, Parameter(("--output", "-o"))],
    scheme: Annotated[str, Parameter(("--scheme", "-s"), help=f"One of {', '.join(SCHEMES)}.")] = "jet",
    value: Annotated[
        list[Value] | None, Parameter(("--value", "-v"), negative="", show_default=False)
    ] = None,
    options: MeshOptions = _PLAIN_MESH,
) -> None:
    """Write curvatures, directions, error bars and quality of every vertex; print what the mesh holds.

    H, k1 and k2 are in 1/length, K in 1/length². error_... are standard errors, interval_... half widths of
    intervals that hold the exact value in 95 of 100 cases, both in the unit of their value; estimate is about
    the error of a scheme, its H less that of "jet"; feature is 1 on creases.

    **Examples**

        quadcurv curvature spot.obj -o spot.ply
        quadcurv curvature spot.obj -o spot.csv -s liu -v mean_curvature -v valence
        quadcurv curvature grid.zarr -o H.zarr -s finite_volume

    Parameters
    ----------
    mesh
        File of a mesh of quads, or of quads and other polygons, or a grid's array of points (.zarr, .npy,
        .h5), whose first row is not repeated with --wrap. Arrays are read and written block by block, of any
        size.
    output
        File to write: a mesh with values, or .csv with a row a vertex, in the order of the file's vertices;
        of an array a new .zarr, .npy or .h5, or one of these.
    scheme
        Of the mean curvature. All other curvatures are its too if it is a jet, else those of "jet".
    value
        Value to write, repeatable; by default all, of an array the mean curvature.
    """
    check_schemes([scheme])
    holders = sorted(suffix for suffix, entry in FORMATS.items() if entry.write and entry.holds_values)
    if mesh.suffix.lower() in STORES and output.suffix.lower() not in (".csv", *holders):
        say(curvature_of_array(mesh, output, scheme, value, options))
        return
    check_file(output, "--output", [".csv", *holders])
    wanted = values_of(scheme, value)
    found = load(mesh, options)
    data = {
        name: found.on_given(array)
        for name, array in values(found.mesh, scheme, options.boundary, wanted).items()
    }
    if output.suffix.lower() == ".csv":
        _write_csv(output, found, data)
    else:
        write(output, found.given, data)
    print(_counts(found.mesh, options.boundary))
    for name in ("mean_curvature", "k1"):
        if name in data:
            print(f"undefined: {np.count_nonzero(~np.isfinite(data[name]))} of {name}")
            break
    say(output)


def view(
    mesh: str,
    /,
    *,
    scheme: Schemes = None,
    field: Annotated[
        str,
        Parameter(help=f"What the colours show first: {', '.join(FIELDS)} or 'difference to SCHEME'."),
    ] = "mean_curvature",
    limits: Annotated[tuple[float, float] | None, Parameter("--range", negative="")] = None,
    html: Path | None = None,
    png: Path | None = None,
    options: MeshOptions = _PLAIN_MESH,
    picture: PictureOptions = _PLAIN_PICTURE,
) -> None:
    """Look at a mesh or a surface: one linked view a scheme.

    **Examples**

        quadcurv view spot.obj
        quadcurv view pillow_sphere --field error -s finite_volume -s cotan-6
        quadcurv view spot.obj --html spot.html --field "difference to liu"
        quadcurv view spot.obj --png spot.png -s jet --range -5 5 --colours coolwarm --size 1200 900

    Parameters
    ----------
    mesh
        File of a mesh, or the name of a surface with exact curvature.
    limits
        Ends of the colour scale of the field: LOW HIGH.
    html
        Write one page that needs no network instead of opening a window.
    png
        Write a picture of the same views.
    """
    check_schemes(scheme)
    check_field(field, scheme, mesh in SURFACES)
    style = picture.style(limits)
    check_file(html, "--html", [".html"])
    check_file(png, "--png", [".png"])
    _check_rendering(html, png)
    refined = _refinements(mesh, scheme, options)
    if refined is None:
        found = load(Path(mesh), options)
        print(_report(found.mesh))
        comparison = compared(found.mesh, scheme, boundary=options.boundary)
    else:
        comparison = refined(viewing.View.START)
    for path in (html, png):
        if path is not None:
            viewing.save_maps(comparison, path, field, style)
            say(path)
    if html is None and png is None:
        viewing.view(comparison, field, style, refined)


def _check_rendering(html: Path | None, png: Path | None) -> None:
    need("matplotlib")
    problem = None
    if png is not None:
        problem = viewing.opengl_problem()
    elif html is None:
        problem = viewing.window_problem()
    if problem:
        raise viewing.NoOpenGLError(f"{problem}; --html FILE writes a page instead")


def _report(mesh: Mesh) -> str:
    """The first line: what the mesh is, and what was mended in it."""
    return f"{mesh!r}: {mesh.report}"


def _counts(mesh: Mesh, boundary: str) -> str:
    """Lines of what a mesh holds, see :func:`quadcurv.mesh_quality.summary`."""
    counts = summary(mesh, schemes=(), boundary=boundary)
    faces = f"faces: {counts['quads']} quads, {counts['triangles']} triangles"
    if counts["polygons"]:
        faces += f" ({counts['polygons']} larger polygon(s) cut into such)"
    if counts["turned"]:
        faces += f"; {counts['turned']} turned"
    vertices = f"vertices: {counts['vertices']}"
    if counts["coincident"]:
        vertices += f", {counts['coincident']} of them where another one is"
    return "\n".join(
        (
            _report(mesh),
            faces,
            vertices,
            "valence: " + ", ".join(f"{valence} ({n})" for valence, n in counts["valence"].items()),
            "rings: " + ", ".join(f"{n} {name}" for name, n in counts["boundary"].items()),
        )
    )


def _refinements(
    name: str, scheme: list[str] | None, options: MeshOptions
) -> Callable[[int], Comparison] | None:
    """Comparisons on the surface of that name, None if it is a file's."""
    if name not in SURFACES:
        if Path(name).suffix or Path(name).exists():
            return None
        raise ValueError(f"{name}: neither a file nor a surface, which are {', '.join(SURFACES)}")
    if options != MeshOptions(boundary=options.boundary):
        raise ValueError(f"{name}: a surface is sampled; --merge, --join, --wrap and --orient are for files")
    surface = SURFACES[name]()
    layout = "faces" if len(surface.panels) > 1 else "staggered"
    length, width = np.ptp(surface.domain, axis=1)
    more = int(np.clip(np.round(np.log2(length / width)), -2, 2))  # doublings, to make cells squarer

    def refined(level: int) -> Comparison:
        shape = 8 * 2 ** (level + max(more, 0)), 8 * 2 ** (level + max(-more, 0))
        mesh, xi, eta = surface.sample(shape, layout)
        return compared(mesh, scheme, surface.mean_curvature(xi, eta), options.boundary)

    return refined


def _write_csv(path: Path, found: Input, data: dict[str, Any]) -> None:
    """A row a vertex; of a grid row by row."""
    axes = found.given.points.ndim - 1
    columns = {"": found.given.points, **data}
    write_csv(path, {name: np.reshape(v, (-1, *np.shape(v)[axes:])) for name, v in columns.items()})


def _save_pictures(comparison: Comparison, folder: Path, stem: str, style: Style) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    problem = viewing.opengl_problem()
    if problem:
        say(f"{problem}; writing pages instead of pictures")
    suffix = ".html" if problem else ".png"
    fields = {"mean_curvature": "mean_curvature", "error": "disagreement"}
    for field, name in list(fields.items())[: len(comparison.schemes)]:  # one scheme disagrees with none
        path = folder / f"{stem}_{name}{suffix}"
        viewing.save_maps(comparison, path, field, style)
        say(path)
