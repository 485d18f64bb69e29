"""Damaged files of every format: a mesh, a MeshError or an OSError, soon and in little memory.

The readers run in processes of their own, with a limit on memory and an alarm, so that a signal, a hang or an
allocation without bound is seen. ``python tests/test_fuzz_files.py SEED COUNT own|foreign`` runs one.
"""

from __future__ import annotations

import random
import re
import signal
import struct
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
import pytest

import quadcurv as qc

NUMBERS = [b"0", b"1", b"-1", b"3", b"255", b"65536", b"2147483647", b"4294967296", b"99999999999999999999"]
NUMBERS += [b"1e308", b"1e999", b"nan", b"-inf", b"1e-320", b"0x10", b"1_0", b"", b"#", b"\n"]
WORDS = [struct.pack(order + code, value) for order in "<>" for code in "iq" for value in (-1, 0, 2**31 - 1)]
SECONDS = 10


def seeds(kind: str) -> list[tuple[str, bytes]]:
    """Whole files, by their suffix."""
    from test_text_files import FACES, OBJ, OFF, PLY, stl

    points = np.pi * np.array(
        [[0, 0, 0], [1, 0, 0.1], [2, 0, 0], [0, 1, 0], [1, 1, 0.2], [2, 1, 0], [3, 0, 0.3], [3, 1, 0.1]]
    )
    meshes = [
        qc.QuadMesh(points, [[0, 1, 4, 3], [2, 6, 7, 5]]),
        qc.QuadMesh(points, [[0, 1, 4, 3], [1, 2, 5], [5, 4, 1], [2, 6, 7, 5]]),
        qc.QuadMesh(points, [[0, 1, 2, 5, 4, 3], [2, 6, 7, 5]]),
    ]
    data = {"H": np.where(np.arange(8) == 2, np.nan, np.arange(8) / 7), "n": points, "k": np.arange(8)}
    found = []
    suffixes = ("ply", "obj", "off") if kind == "own" else ("vtp", "vtu", "vtk", "vtkhdf", "glb")
    with tempfile.TemporaryDirectory() as folder:
        for suffix in suffixes:
            for mesh in meshes:
                path = Path(folder) / f"a.{suffix}"
                qc.write(path, mesh, None if suffix in ("obj", "off") else data)
                found.append((suffix, path.read_bytes()))
        if kind == "foreign":
            import pyvista as pv

            grid = pv.StructuredGrid(*np.meshgrid([0.0, 1], [0.0, 1, 2], [0.0], indexing="ij"))
            for binary in (True, False):
                for suffix in ("vts", "vtk"):
                    grid.save(Path(folder) / f"g.{suffix}", binary=binary)
                    found.append((suffix, (Path(folder) / f"g.{suffix}").read_bytes()))
                qc.to_pyvista(meshes[1]).save(Path(folder) / "p.vtp", binary=binary)
                found.append(("vtp", (Path(folder) / "p.vtp").read_bytes()))
    if kind == "own":
        found += [("obj", text) for text in OBJ.values()]
        found += [("off", text) for text in OFF.values()]
        found += [("ply", text) for text in PLY.values()]
        found += [("stl", stl(np.array(points)[np.ravel(FACES)], binary)) for binary in (True, False)]
    return found


def mutated(content: bytes, other: bytes, rng: random.Random) -> bytes:
    """One to four damages."""
    data = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(data) + 1)
        length = rng.choice((1, 2, 4, 8, rng.randint(1, 60)))
        match rng.randrange(8):
            case 0:
                data[at : at + 1] = bytes([rng.randrange(256)])
            case 1:
                data[at : at + 1] = bytes([data[at] ^ (1 << rng.randrange(8))]) if at < len(data) else b"\0"
            case 2:
                del data[at : at + length]
            case 3:
                data[at:at] = data[at : at + length] * rng.randint(1, 3)
            case 4:
                numbers = [found.span() for found in re.finditer(rb"[-+.\w]+", data)]
                if numbers:
                    begin, end = rng.choice(numbers)
                    data[begin:end] = rng.choice(NUMBERS)
            case 5:
                data[at : at + length] = rng.choice(WORDS)
            case 6:
                begin = rng.randrange(len(other))
                data[at:at] = other[begin : begin + length]
            case 7 if rng.random() < 0.3:
                del data[at:]
    return bytes(data)


def limit_memory(largest: int) -> None:
    """As much as it has now, 200 MB and 20 times the file."""
    import resource

    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    most = taken + (200 << 20) + 20 * largest
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def late(*_: object) -> None:
    raise TimeoutError(f"more than {SECONDS} s")


def run(seed: int, count: int, kind: str) -> None:
    """Read that many damaged files; print what is wrong with the first that is not as it should be."""
    files = seeds(kind)
    warnings.simplefilter("ignore")
    for suffix, content in files if kind == "own" else files[:1]:  # all that is loaded on demand
        path = Path(tempfile.gettempdir()) / f"quadcurv_seed.{suffix}"
        path.write_bytes(content)
        qc.read(path, join=True)
        path.unlink()
    if kind == "own" and sys.platform == "linux":
        limit_memory(max(len(content) for _, content in files))
    signal.signal(signal.SIGALRM, late)
    rng = random.Random(seed)
    read = 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            suffix, content = rng.choice(files)
            path = Path(folder) / f"damaged.{suffix}"
            damaged = mutated(content, rng.choice(files)[1], rng)
            path.write_bytes(damaged)
            signal.alarm(SECONDS)
            print(f"at {number}", file=sys.stderr, flush=True)
            try:
                mesh = qc.read(path)
                read += np.isfinite(mesh.points).all()
                qc.read_values(path)
            except (qc.MeshError, OSError) as error:
                if not str(error):
                    print("wrong", number, suffix, "says nothing", damaged)
            except BaseException as error:
                print("wrong", number, suffix, type(error).__name__, error, damaged)
                return
            signal.alarm(0)
    print("right", read)


def fuzzed(seed: int, count: int, kind: str) -> int:
    """How many of the damaged files could be read all the same; none was wrong."""
    command = [sys.executable, __file__, str(seed), str(count), kind]
    found = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[1])
    last = found.stderr.strip().splitlines()[-1:]
    assert found.returncode == 0, f"exit code {found.returncode}, {last}, {found.stdout[-2000:]}"
    assert found.stdout.startswith("right"), found.stdout[:2000]
    return int(found.stdout.split()[1])


@pytest.mark.parametrize(("kind", "count"), [("own", 400), ("foreign", 6)])
def test_damaged_files_are_mesh_errors(kind, count):
    assert fuzzed(1, count, kind) < count


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "count", "seed"), [*(("own", 4940, seed) for seed in range(2, 6)), ("foreign", 240, 6)]
)
def test_twenty_thousand_damaged_files_are_mesh_errors(kind, count, seed):
    assert 0 < fuzzed(seed, count, kind) < count


def test_damages_are_damages():
    """What the other tests rely on: files are whole before, and nearly all different after."""
    files = seeds("own")
    rng = random.Random(0)
    same = sum(mutated(content, content, rng) == content for _, content in files for _ in range(10))
    assert len(files) > 50
    assert same < len(files)


if __name__ == "__main__":
    run(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
