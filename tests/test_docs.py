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


CLIPPED = """
const scrolls = e => { for (; e && !e.matches('article'); e = e.parentElement)
  if (/auto|scroll/.test(getComputedStyle(e).overflowX)) return true;
  return false };
return [...document.querySelectorAll('article :is(p, dt, dd, h1, h2, h3, li, code, td, th, img, iframe)')]
  .filter(e => e.getBoundingClientRect().right > innerWidth + 1 && !scrolls(e))
  .map(e => e.tagName + ' ' + e.textContent.slice(0, 40)).slice(0, 3)
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The pages, built without a warning."""
    pytest.importorskip("sphinx_gallery")
    pytest.importorskip("pymeshlab", exc_type=ImportError)
    folder = tmp_path_factory.mktemp("site") / "html"
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-E", DOCS, folder]
    run = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False)
    assert run.returncode == 0, run.stderr
    return folder


@pytest.mark.slow
def test_pages_load_nothing_from_elsewhere(site):
    page = (site / "auto_examples" / "cubed_sphere.html").read_text()
    assert "<iframe srcdoc=" in page
    for built in site.rglob("*.html"):
        loaded = re.findall(
            r"<(?:script|link|img|iframe)[^>]*(?:src|href)=.(https?://[^\"']+)", built.read_text()
        )
        assert not loaded, f"{built.name} loads {loaded}"


@pytest.mark.slow
@pytest.mark.parametrize("width", [400, 800, 1600])
def test_nothing_is_cut_on_screens_of_any_width(site, browser, width):
    screen = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    for page in site.rglob("*.html"):
        if "_static" not in page.parts:
            browser.get(page.as_uri())
            assert browser.execute_script(CLIPPED) == [], page.name
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_the_paper_cites_what_it_lists_and_names_files_that_exist():
    paper, listed = ((DOCS / name).read_text(encoding="utf-8") for name in ("paper.md", "paper.bib"))
    cited = set(re.findall(r"@(\w+)", paper))
    assert cited == set(re.findall(r"@\w+\{(\w+),", listed))
    peers = (DOCS.parent / "comparisons" / "PEERS.md").read_text(encoding="utf-8")
    assert ("sixteen kinds of meshes" in paper) == ("Mean errors on 16 meshes" in peers)
    first = re.findall(r"`jet` is first on (\d+) of 16 meshes", peers)[:2]
    assert ("in mean and in Gaussian curvature the default of `quadcurv` on all sixteen" in paper) == (
        first == ["16", "16"]
    )
    for name in re.findall(r"`(comparisons/[\w./]+)`", paper):
        assert (DOCS.parent / name).exists(), name
