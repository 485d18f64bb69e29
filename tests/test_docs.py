"""The documentation: every public object is in it, its examples run, it builds without a warning."""

from __future__ import annotations

import doctest
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import quadcurv as qc
from quadcurv import comparison, curves, estimate, pyvista_plugin, refinement, schemes, surfaces, viewing

DOCS = Path(__file__).parents[1] / "docs"
PAGES = sorted(page for page in DOCS.rglob("*.md") if "_build" not in page.parts)
CONSTANTS = {"SCHEMES", "SURFACES", "FIELDS"}

PUBLIC = {
    f"{module.__name__}.{name}": getattr(module, name)
    for module in (qc, viewing, surfaces, schemes, curves)
    for name in (module.__all__ if hasattr(module, "__all__") else dir(module))
    if not name.startswith("_") and name not in CONSTANTS and not inspect.ismodule(getattr(module, name))
}
BESIDE = (
    comparison.Comparison,
    comparison.norms,
    refinement.Convergence,
    estimate.richardson,
    estimate.disagreement,
    pyvista_plugin.Accessor,
)
OBJECTS = {
    f"{o.__module__}.{o.__qualname__}": o for o in (*PUBLIC.values(), *BESIDE) if hasattr(o, "__qualname__")
}


@pytest.mark.parametrize("name", sorted(OBJECTS))
def test_examples_in_docstrings(name):
    found = inspect.unwrap(OBJECTS[name])
    assert "Examples\n--------" in inspect.getdoc(found), f"{name} has no Examples"
    examples = doctest.DocTestFinder(recurse=False).find(found, name, globs={})
    assert examples[0].examples, f"the Examples of {name} are none"
    _run(examples[0])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(DOCS).as_posix())
def test_examples_in_pages(page):
    sessions = re.findall(r"```pycon\n(.*?)```", page.read_text(), re.DOTALL)
    _run(doctest.DocTestParser().get_doctest("\n".join(sessions), {}, page.name, str(page), 0))


def _run(test):
    said = []
    runner = doctest.DocTestRunner(verbose=False)
    runner.run(test, out=said.append)
    assert not runner.failures, "".join(said)


def test_reference_lists_every_public_object():
    text = "\n".join(page.read_text() for page in (DOCS / "api").glob("*.rst"))
    entries = set()
    for block in re.split(r"\.\. currentmodule:: ", text)[1:]:
        module = block.split()[0]
        entries |= {
            f"{module}.{line.strip()}" for line in block.splitlines() if re.fullmatch(r"   [\w.]+", line)
        }
    short = {entry.rpartition(".")[2] for entry in entries}
    missing = {name for name in PUBLIC if name.rpartition(".")[2] not in short}
    assert missing <= {"quadcurv.schemes.Scheme"}
    constants = re.findall(r"quadcurv\.(?:\w+\.)?([A-Z]+)``", text)
    assert set(constants) >= CONSTANTS


def test_guide_names_every_scheme():
    text = (DOCS / "guide" / "operators.md").read_text()
    for scheme in qc.SCHEMES:
        stem = scheme.removesuffix("-voronoi")
        assert f"`{scheme}`" in text or (f"`{stem}`" in text and "`-voronoi`" in text), scheme


@pytest.mark.slow
def test_builds_without_a_warning(tmp_path):
    pytest.importorskip("sphinx_gallery")
    pytest.importorskip("pymeshlab", exc_type=ImportError)
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-E", DOCS, tmp_path / "html"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert run.returncode == 0, run.stderr
    page = (tmp_path / "html" / "auto_examples" / "cubed_sphere.html").read_text()
    assert "<iframe srcdoc=" in page
    for built in (tmp_path / "html").rglob("*.html"):
        loaded = re.findall(
            r"<(?:script|link|img|iframe)[^>]*(?:src|href)=.(https?://[^\"']+)", built.read_text()
        )
        assert not loaded, f"{built.name} loads {loaded}"


def test_the_paper_cites_what_it_lists_and_names_files_that_exist():
    paper, listed = ((DOCS / name).read_text(encoding="utf-8") for name in ("paper.md", "paper.bib"))
    cited = set(re.findall(r"@(\w+)", paper))
    assert cited == set(re.findall(r"@\w+\{(\w+),", listed))
    peers = (DOCS.parent / "comparisons" / "PEERS.md").read_text(encoding="utf-8")
    assert ("sixteen kinds of meshes" in paper) == ("Mean errors on 16 meshes" in peers)
    assert "first on 16 of 16" not in peers  # "which is not always `quadcurv`"
    for name in re.findall(r"`(comparisons/[\w./]+)`", paper):
        assert (DOCS.parent / name).exists(), name
