"""The command line: compare, curvature, view, reproduce."""

from __future__ import annotations

import json
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import App, CycloptsError, Parameter
from rich.console import Console

import quadcurv
from quadcurv.boundary import boundary_treatment
from quadcurv.comparison import Comparison
from quadcurv.curvature import mean_curvature, vertex_normals
from quadcurv.io import read, write
from quadcurv.mesh import Mesh
from quadcurv.schemes import SCHEMES, as_scheme
from quadcurv.tables import write_csv
from quadcurv.viewing.fields import FIELDS

_COMPARISONS = Path(__file__).resolve().parents[1] / "comparisons"

app = App(
    name="quadcurv",
    help="Mean curvature on quad meshes, with every operator side by side.",
    help_format="markdown",
    help_epilogue="`quadcurv COMMAND --help` shows examples of each.",
    version=quadcurv.__version__,
)
app.register_install_completion_command(help="Install completion for this shell.")

Schemes = Annotated[
    list[str] | None,
    Parameter(
        ("--scheme", "-s"),
        negative="",
        help=f"Scheme, repeatable; by default all: {', '.join(SCHEMES)}.",
        show_default=False,
    ),
]


@app.command
def compare(
    mesh: Path,
    /,
    *,
    scheme: Schemes = None,
    output: Path | None = None,
    csv_file: Annotated[Path | None, Parameter("--csv")] = None,
    as_json: Annotated[bool, Parameter("--json", negative="")] = False,
) -> None:
    """Mean curvature of a mesh by several schemes: tables and pictures.

    First come counts of faces, valences and boundary. Schemes are compared with their median at each
    vertex, by valence and in pairs. Two pictures, one view a scheme, show the mean curvature and the
    disagreement: PNG, or a page in HTML where nothing can render.

    **Examples**

        quadcurv compare spot.obj
        quadcurv compare spot.obj -s finite_volume -s liu -s cotan-6 --output pictures
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
    comparison = _comparison(mesh, scheme)
    if as_json:
        print(json.dumps(comparison.to_dict(), indent=2))
    else:
        print(_counts(comparison.mesh))
        Console().print(comparison)
    if csv_file is not None:
        comparison.to_csv(csv_file)
    if output is None and not as_json:
        output = Path("quadcurv-output")
    if output is not None:
        _save_pictures(comparison, output, mesh.stem)


@app.command
def curvature(
    mesh: Path,
    /,
    *,
    output: Annotated[Path, Parameter(("--output", "-o"))],
    scheme: Annotated[
        str, Parameter(("--scheme", "-s"), help=f"One of {', '.join(SCHEMES)}.")
    ] = "finite_volume",
) -> None:
    """Write mean curvature, normal and quality of every vertex, and print what the mesh holds.

    **Examples**

        quadcurv curvature spot.obj -o spot.ply
        quadcurv curvature spot.obj -o spot.csv -s liu

    Parameters
    ----------
    mesh
        File of a mesh of quads, or of quads and other polygons.
    output
        File to write: .ply or .vtp with the mesh and its faces, .glb triangulated, .csv with a row a vertex.
    """
    from quadcurv.mesh_quality import quality

    found = read(mesh)
    H = mean_curvature(found, as_scheme(scheme))
    data: dict[str, Any] = {
        "mean_curvature": H,
        "Normals": vertex_normals(found),
        "boundary": boundary_treatment(found),
        **quality(found),
    }
    if output.suffix.lower() == ".csv":
        stencils = found.stencils()
        columns = {"": stencils.points[: stencils.n], **data}
        inner = {name: np.shape(values)[len(stencils.shape) :] for name, values in data.items()} | {"": (3,)}
        write_csv(output, {name: np.reshape(v, (stencils.n, *inner[name])) for name, v in columns.items()})
    else:
        write(output, found, data)
    print(_counts(found))
    print(f"undefined: {np.count_nonzero(~np.isfinite(H))} by {scheme}")
    _say(output)


@app.command
def view(
    mesh: str,
    /,
    *,
    scheme: Schemes = None,
    field: Annotated[
        str,
        Parameter(help=f"What the colours show first: {', '.join(FIELDS)} or 'difference to SCHEME'."),
    ] = "mean_curvature",
    html: Path | None = None,
    png: Path | None = None,
) -> None:
    """Look at a mesh or a surface: one linked view a scheme.

    **Examples**

        quadcurv view spot.obj
        quadcurv view pillow_sphere --field error -s finite_volume -s cotan-6
        quadcurv view spot.obj --html spot.html --field "difference to liu"

    Parameters
    ----------
    mesh
        File of a mesh, or the name of a surface with exact curvature.
    html
        Write one page that needs no network instead of opening a window.
    png
        Write a picture of the same views.
    """
    from quadcurv import viewing

    refined = _refinements(mesh, scheme)
    comparison = refined(viewing.View.START) if refined else _comparison(mesh, scheme)
    for path in (html, png):
        if path is not None:
            viewing.save_maps(comparison, path, field)
            _say(path)
    if html is None and png is None:
        problem = viewing.window_problem()
        if problem:
            raise viewing.NoOpenGLError(f"{problem}; --html FILE writes a page instead")
        viewing.view(comparison, field, refined=refined)


@app.command
def reproduce(
    names: Annotated[list[str] | None, Parameter(negative="")] = None,
    /,
    *,
    output: Path | None = None,
    quick: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Run the scripts that reproduce the figures and claims of the thesis.

    They live in the repository, beside the package.

    **Examples**

        quadcurv reproduce
        quadcurv reproduce chapter4 --output figures

    Parameters
    ----------
    names
        Scripts to run; by default those of all chapters.
    output
        Folder for figures and tables; by default that of the script.
    quick
        Smaller sizes.
    """
    known = sorted(p.stem for p in _COMPARISONS.glob("*.py") if p.stem not in ("__init__", "common"))
    if not known:
        raise ValueError(
            "the comparisons are not part of the installed package: clone the repository, install it with "
            "'pip install -e .' and run this again"
        )
    names = names or [name for name in known if name.startswith("chapter")]
    for name in names:
        if name not in known:
            raise ValueError(f"expected any of {', '.join(known)}, got {name!r}")
    options = ["--quick"] * quick
    if output is not None:
        options += ["--output", str(output.resolve())]
    for name in names:
        command = [sys.executable, "-m", f"comparisons.{name}", *options]
        code = subprocess.run(command, cwd=_COMPARISONS.parent, check=False).returncode
        if code:
            raise SystemExit(code)


def main(arguments: Iterable[str] | None = None) -> None:
    """Run the command line; what is wrong with the input takes one line and exit code 2."""
    from quadcurv.viewing import NoOpenGLError

    with warnings.catch_warnings():
        warnings.simplefilter("default", UserWarning)
        warnings.showwarning = lambda message, *_: _say(f"warning: {message}")
        try:
            app(arguments, exit_on_error=False, print_error=False)
        except BrokenPipeError:  # the reader, such as head, has seen enough
            sys.stderr.close()
            raise SystemExit(0) from None
        except (CycloptsError, NoOpenGLError, ValueError, OSError) as error:
            _say(_message(error))
            raise SystemExit(2) from None


def _counts(mesh: Mesh) -> str:
    """Lines of what a mesh holds, see :func:`quadcurv.mesh_quality.summary`."""
    from quadcurv.mesh_quality import summary

    counts = summary(mesh, schemes=())
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
            faces,
            vertices,
            "valence: " + ", ".join(f"{valence} ({n})" for valence, n in counts["valence"].items()),
            "rings: " + ", ".join(f"{n} {name}" for name, n in counts["boundary"].items()),
        )
    )


def _comparison(mesh: str | Path, scheme: list[str] | None) -> Comparison:
    from quadcurv.comparison import compare

    return compare(read(mesh), scheme)


def _refinements(name: str, scheme: list[str] | None) -> Callable[[int], Comparison] | None:
    """Comparisons on the surface of that name, None if it is a file's."""
    from quadcurv.comparison import compare
    from quadcurv.surfaces import SURFACES

    if name not in SURFACES:
        if Path(name).suffix or Path(name).exists():
            return None
        raise ValueError(f"{name}: neither a file nor a surface, which are {', '.join(SURFACES)}")
    surface = SURFACES[name]()
    layout = "faces" if len(surface.panels) > 1 else "staggered"

    length, width = np.ptp(surface.domain, axis=1)
    more = int(np.clip(np.round(np.log2(length / width)), -2, 2))  # doublings, to make cells squarer

    def refined(level: int) -> Comparison:
        shape = 8 * 2 ** (level + max(more, 0)), 8 * 2 ** (level + max(-more, 0))
        mesh, xi, eta = surface.sample(shape, layout)
        return compare(mesh, scheme, surface.mean_curvature(xi, eta))

    return refined


def _save_pictures(comparison: Comparison, folder: Path, stem: str) -> None:
    from quadcurv.viewing import opengl_problem, save_maps

    folder.mkdir(parents=True, exist_ok=True)
    problem = opengl_problem()
    if problem:
        _say(f"{problem}; writing pages instead of pictures")
    suffix = ".html" if problem else ".png"
    for field, name in (("mean_curvature", "mean_curvature"), ("error", "disagreement")):
        path = folder / f"{stem}_{name}{suffix}"
        save_maps(comparison, path, field)
        _say(path)


def _message(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)


def _say(message: object) -> None:
    """One line beside the results."""
    print(f"quadcurv: {' '.join(str(message).split())}", file=sys.stderr)


if __name__ == "__main__":
    main()
