"""Options that several commands share, checked before anything is read or computed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from quadcurv.schemes import SCHEMES, as_scheme
from quadcurv.viewing import Style
from quadcurv.viewing.fields import field_names

_MESH = Group("Mesh", sort_key=1)
_PICTURE = Group("Pictures", sort_key=2)

Schemes = Annotated[
    list[str] | None,
    Parameter(
        ("--scheme", "-s"),
        negative="",
        help=f"Scheme, repeatable; by default all: {', '.join(SCHEMES)}.",
        show_default=False,
    ),
]


@Parameter(name="*", group=_MESH)
@dataclass(frozen=True)
class MeshOptions:
    """What to make of a file before anything is computed.

    Attributes
    ----------
    merge
        Merge vertices this far apart, as at seams, by default a millionth of the mesh's extent. Without this
        option it is done, and said, where boundary vertices lie at the same place; --no-merge never does.
    join
        Join the shapes of a scene; --no-join refuses a scene of several.
    wrap
        Directions of a grid that are closed, where the last row or column repeats the first.
    orient
        Turn closed parts so that normals point outward.
    boundary
        What is done at open sides: "nan" leaves them without values.
    """

    merge: Annotated[float | bool | None, Parameter(negative="--no-merge", show_default=False)] = None
    join: bool = True
    wrap: Literal["rows", "columns", "both"] | None = None
    orient: Annotated[bool, Parameter(negative="")] = False
    boundary: Literal["extrapolate", "nan"] = "extrapolate"

    def __post_init__(self) -> None:
        if self.merge is not None and not isinstance(self.merge, bool) and not 0 <= self.merge < float("inf"):
            raise ValueError(f"--merge: expected a length, got {self.merge}")

    @property
    def wraps(self) -> tuple[bool, bool] | None:
        """As :func:`quadcurv.as_mesh` takes it."""
        return (
            None if self.wrap is None else (self.wrap in ("rows", "both"), self.wrap in ("columns", "both"))
        )


@Parameter(name="*", group=_PICTURE)
@dataclass(frozen=True)
class PictureOptions:
    """How pictures and pages look.

    Attributes
    ----------
    camera
        Direction from the surface to the viewer: X Y Z.
    size
        Width and height of a picture or a page in pixels.
    colours
        Colour map of matplotlib.
    title
        A line above all views.
    shading
        Light the surface, which shows its shape and falsifies colours.
    thin
        Show all fields of a page beyond 20 MB on fewer vertices, instead of fewer fields.
    """

    camera: Annotated[tuple[float, float, float] | None, Parameter(negative="")] = None
    size: Annotated[tuple[int, int] | None, Parameter(negative="")] = None
    colours: Annotated[str | None, Parameter(("--colours", "--colors"))] = None
    title: str | None = None
    shading: Annotated[bool, Parameter(negative="")] = False
    thin: Annotated[bool, Parameter(negative="")] = False

    def style(self, limits: tuple[float, float] | None = None) -> Style:
        """The same for :mod:`quadcurv.viewing`."""
        return Style(self.camera, self.size, limits, self.colours, self.title, self.shading, self.thin)


def check_schemes(names: Iterable[str] | None) -> None:
    """Refuse unknown schemes, and those given twice."""
    names = list(names or ())
    for name in names:
        as_scheme(name)
    if len(set(names)) < len(names):
        raise ValueError(f"--scheme: expected each once, got {', '.join(names)}")


def check_field(field: str, schemes: Iterable[str] | None, exact: bool) -> None:
    """Refuse a field that a comparison of these schemes does not have."""
    known = field_names(list(schemes or SCHEMES), exact)
    if field not in known:
        raise ValueError(f"field: expected one of {', '.join(known)}, got {field!r}")


def check_file(path: Path | None, option: str, suffixes: Iterable[str] = ()) -> None:
    """Refuse a file in no folder, one that is a folder, and a suffix that nobody writes."""
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        given = path.suffix or "a file without suffix"
        raise ValueError(f"{option}: cannot write {given}; there are {', '.join(suffixes)}")
    if path.is_dir():
        raise ValueError(f"{option}: {path} is a folder")
    if not path.absolute().parent.is_dir():
        raise ValueError(f"{option}: there is no folder {path.absolute().parent}")


def check_folder(path: Path | None, option: str) -> None:
    """Refuse a folder that is a file, or in one."""
    if path is None:
        return
    for part in (path, *path.parents):
        if part.exists():
            if not part.is_dir():
                raise ValueError(f"{option}: {part} is no folder")
            return
