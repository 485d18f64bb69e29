"""Quality of meshes on cases known by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadcurv import (
    SCHEMES,
    Laplacian,
    MeshWarning,
    QuadGrid,
    QuadMesh,
    StaggeredGrid,
    mean_curvature,
    read,
    surfaces,
)
from quadcurv.mesh_quality import quality, summary

LAPLACIANS = [name for name, scheme in SCHEMES.items() if isinstance(scheme, Laplacian)]
CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def of_face(name, corners):
    corners = np.array(corners, float)
    if corners.shape[1] == 2:
        corners = np.pad(corners, [(0, 0), (0, 1)])
    values = quality(QuadMesh(corners, [list(range(len(corners)))]))[name]
    assert np.array_equal(values, np.full(len(corners), values[0]), equal_nan=True)
    return values[0]


@pytest.mark.parametrize(
    ("name", "corners", "expected"),
    [
        ("nonplanarity", [(0, 0), (3, 0), (4, 2), (1, 5)], 0),
        # Diagonals of length sqrt(2) that cross at right angles, one 0.3 above the other.
        ("nonplanarity", [(0, 0, 0), (1, 0, 0.3), (1, 1, 0), (0, 1, 0.3)], 0.3 / np.sqrt(2)),
        ("nonplanarity", [(0, 0, 0), (1, 0, 0), (1, 1, 4)], 0),
        ("nonplanarity", [(0, 0), (1, 1), (1, 0), (0, 1)], np.nan),
        ("skew", [(0, 0), (3, 0), (3, 2), (0, 2)], 0),
        ("skew", [(0, 0), (1, 0), (1.5, np.sqrt(0.75)), (0.5, np.sqrt(0.75))], 30),
        ("skew", [(0, 0), (1, 0), (0.5, np.sqrt(0.75))], 0),
        ("skew", [(0, 0), (1, 0), (0, 1)], 30),
        # The angle at (1, 0) turns inward: 360 degrees less the one between (1, -2) and (1, 2).
        ("skew", [(0, 0), (2, -2), (1, 0), (2, 2)], 270 - 2 * np.degrees(np.arctan(2))),
        ("skew", [(0, 0), (0, 0), (1, 1), (0, 1)], np.nan),
        ("skew", [(0, 0), (1, 1), (1, 0), (0, 1)], np.nan),
        ("aspect", [(0, 0), (3, 0), (3, 1), (0, 1)], 3),
        ("aspect", [(0, 0), (3, 0), (3, 4)], 5 / 3),
        ("aspect", [(0, 0), (1, 0), (1, 1), (1, 1)], np.nan),
    ],
)
def test_one_face(name, corners, expected):
    assert of_face(name, corners) == pytest.approx(expected, abs=1e-9, nan_ok=True)


def test_a_quad_that_crosses_itself_is_skew_beyond_a_right_angle():
    assert of_face("skew", [(0, 0), (3, 0), (0.5, 2), (3, 1)]) > 90
    assert of_face("skew", [(0, 0), (3, 0), (3, 1), (0.5, 2)]) < 90


def test_a_vertex_has_its_worst_face():
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (3, 0, 0), (3, 1, 0), (9, 9, 9)]
    found = quality(QuadMesh(np.array(points, float), [[0, 1, 2, 3], [1, 4, 5, 2]]))
    assert found["aspect"].tolist()[:6] == [1, 2, 2, 1, 2, 2]
    assert found["valence"].tolist() == [1, 2, 2, 1, 1, 1, 0]
    assert all(np.isnan(found[name][6]) for name in ("nonplanarity", "skew", "aspect", "roughness"))


def test_triangles_do_not_pass_for_quads():
    """A triangle has no fourth angle, edge or diagonal that could count."""
    points = np.array([(0, 0, 0), (2, 0, 0), (1, np.sqrt(3), 0), (3, np.sqrt(3), 1)], float)
    found = quality(QuadMesh(points, [[0, 1, 2], [2, 1, 3]]))
    assert found["skew"][0] == pytest.approx(0, abs=1e-9)
    assert found["aspect"][0] == pytest.approx(1)
    assert (found["nonplanarity"] == 0).all()


def test_roughness():
    """Zero inside and on smooth lines but for rounding; NaN where no lines of five points end."""
    i, j = np.mgrid[0:9.0, 0:9.0]
    points = np.stack((i, j, 0 * i), axis=-1)
    assert quality(QuadGrid(points))["roughness"] == pytest.approx(np.zeros((9, 9)))
    points[2, 4, 2] = 0.01
    rough = quality(QuadGrid(points))["roughness"]
    assert (rough[1:-1, 1:-1] == 0).all()
    assert rough[0, 4] > 0.06  # X_2 counts six times
    mesh = QuadGrid(points).to_mesh()
    np.testing.assert_allclose(quality(mesh)["roughness"], rough.ravel(), rtol=1e-9, atol=1e-9)
    assert np.isnan(quality(QuadGrid(points[:3, :3]))["roughness"]).sum() == 8
    points[3:, :, 2] = 7
    assert quality(QuadGrid(points, (True, True)))["roughness"].tolist() == np.zeros((9, 9)).tolist()


@pytest.mark.parametrize("scheme", ["finite_volume", "liu"])
@pytest.mark.parametrize("damage", ["nothing", "jitter", "narrow", "wide"])
@pytest.mark.parametrize("name", ["sphere", "tanh_sheet", "catenoid"])
def test_roughness_bounds_the_error_at_the_border(name, damage, scheme, rng):
    """Below one half: twice it, of the larger principal curvature, beyond the error inside."""
    surface = surfaces.SURFACES[name]()
    t = [
        np.linspace(a, b, 33 - wraps, endpoint=not wraps)
        for (a, b), wraps in zip(surface.domain, surface.wrap, strict=True)
    ]
    axis = int(surface.wrap[0])
    step = t[axis][1] - t[axis][0]
    t[axis][0] += {"narrow": 0.4, "wide": -0.6}.get(damage, 0.0) * step
    xi, eta = np.meshgrid(*t, indexing="ij")
    if damage == "jitter":
        xi, eta = (
            x + rng.uniform(-0.01, 0.01, x.shape) * (s[1] - s[0]) for x, s in zip((xi, eta), t, strict=True)
        )
    grid = QuadGrid(surface.mapping(xi, eta), surface.wrap)
    rough = quality(grid)["roughness"]
    error = np.abs(mean_curvature(grid, scheme) - surface.mean_curvature(xi, eta))
    largest = max(np.abs(k).max() for k in surface.principal_curvatures(xi, eta))
    said = (rough > 0) & (rough < 0.5)
    inside = error[rough == 0].max()
    assert (error[said] < 2 * rough[said] * largest + 3 * inside).all()


def test_roughness_of_cells():
    surface = surfaces.tanh_sheet()
    t = np.linspace(-2, 2, 13)
    cells = StaggeredGrid.from_mapping(surface.mapping, t, t)
    assert not quality(cells)["roughness"].any()
    bare = StaggeredGrid(cells.primal[1:-1, 1:-1], cells.dual)
    rough = quality(bare)["roughness"]
    assert rough.shape == (10, 10)
    assert (rough > 0).sum() == 36


def test_quality_does_not_depend_on_place_size_or_sides(mixed):
    expected = quality(mixed)
    turn = Rotation.from_rotvec([0.3, -1.0, 0.7]).as_matrix()
    moved = quality(QuadMesh(1e-3 * mixed.points @ turn.T + 2, mixed.faces))
    faces = np.where(mixed.faces[:, 3:] < 0, mixed.faces[:, [0, 2, 1, 3]], mixed.faces[:, ::-1])
    turned = quality(QuadMesh(mixed.points, faces))
    for name, values in expected.items():
        assert np.allclose(moved[name], values, rtol=1e-9, atol=1e-9)
        assert np.allclose(turned[name], values, rtol=1e-12, atol=1e-12)
        assert np.isfinite(values).all()


def test_summary():
    """A cube with a house on top: five walls and a floor of quads, triangles and a pentagon."""
    roof = np.array([(0.5, 0, 1.5), (0.5, 1, 1.5)])
    apart = np.array([(3, 0, 0), (4, 0, 0), (4, 1, 0), (1, 1, 1), (7, 7, 7)])
    faces = [
        (0, 2, 6, 4),  # floor
        (0, 4, 5, 8, 1),
        (2, 3, 9, 7, 6),
        (0, 1, 3, 2),
        (6, 7, 5, 4),  # against its neighbours
        (1, 8, 9, 3),
        (8, 5, 7),
        (8, 7, 9),
        (10, 11, 12, 13),
    ]
    faces[4] = faces[4][::-1]
    with pytest.warns(MeshWarning, match=r"1 face\(s\) turned"):
        mesh = QuadMesh(np.vstack((CUBE, roof, apart)), faces)
    found = summary(mesh, boundary="nan")
    assert found["vertices"] == 15
    assert found["quads"] == 5
    assert found["triangles"] == 2 + 2 * 3
    assert found["polygons"] == 2
    assert found["turned"] == 1
    assert found["coincident"] == 1
    assert sum(found["valence"].values()) == 15
    assert found["valence"][0] == 1
    assert found["valence"][1] == 4
    assert found["boundary"] == {"interior": 10, "extrapolated": 0, "fitted": 0, "open": 5}
    assert list(found["undefined"]) == list(SCHEMES)
    assert {found["undefined"][name] for name in LAPLACIANS} == {5}


def test_summary_of_grids():
    grid = surfaces.catenoid().sample((8, 10))[0]
    expected = {"vertices": 90, "quads": 80, "triangles": 0, "polygons": 0, "turned": 0, "coincident": 0}
    found = summary(grid, ["liu"])
    assert {name: found[name] for name in expected} == expected
    assert found["valence"] == {2: 20, 4: 70}
    assert found["boundary"] == {"interior": 70, "extrapolated": 20, "fitted": 0, "open": 0}
    assert found["undefined"] == {"liu": 0}
    assert summary(grid, ["liu"], boundary="nan")["undefined"] == {"liu": 20}
    with pytest.raises(ValueError, match="scheme: expected one of"):
        summary(grid, ["nobody's"])


def test_holes_of_a_grid_are_no_vertices():
    grid = surfaces.torus().sample((12, 10))[0]
    mask = np.zeros((12, 10), bool)
    mask[3, 4] = mask[8, 7] = True
    found = summary(QuadGrid(grid.points, grid.wrap, mask=mask), ["liu"], boundary="nan")
    assert found["vertices"] == sum(found["valence"].values()) == sum(found["boundary"].values()) == 118
    assert found["undefined"] == {"liu": 16}
    assert found["boundary"]["open"] == 16


def test_real_meshes(shared_meshes):
    counts = {
        "fish_control_mesh.obj": (112, 100, 20, 4),
        "penguin_control_mesh.obj": (201, 169, 60, 4),
        "quadknot.obj": (1440, 1440, 0, 0),
        "spot_control_mesh.obj": (188, 160, 52, 16),
        "spot_quadrangulated.obj": (2930, 2928, 0, 0),
    }
    for name, count in counts.items():
        mesh = read(shared_meshes / name)
        found = summary(mesh)
        print(name, found)
        assert (found["vertices"], found["quads"], found["triangles"], found["polygons"]) == count
        assert found["boundary"] == {"interior": count[0], "extrapolated": 0, "fitted": 0, "open": 0}
        undefined = found["undefined"]
        assert not any(undefined[scheme] for scheme in LAPLACIANS)
        # Where the least rings of a control mesh are steep, one ring may not determine a quadratic.
        assert max(undefined.values()) <= (12 if "control" in name else 0)
        for values in quality(mesh).values():
            assert np.isfinite(values).all()
