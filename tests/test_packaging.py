"""What a packager gets: a source distribution that tests run from; metadata and a recipe that agree."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import pytest

import quadcurv as qc

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
BUILD = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]
ELSEWHERE = {  # names in conda-forge
    "libigl": "igl",
    "mapbox-earcut": "mapbox_earcut",
    "matplotlib": "matplotlib-base",
    "vtk": "vtk-base",
}


@pytest.fixture(scope="session")
def tracked():
    if not (ROOT / ".git").exists():
        pytest.skip("no checkout")
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True
    )
    return {name for name in listed.stdout.splitlines() if (ROOT / name).is_file()}


@pytest.fixture(scope="session")
def sdist(tracked, tmp_path_factory):
    copy, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("dist")
    for name in tracked:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, copy / name)
    code = "import sys; from setuptools import build_meta; build_meta.build_sdist(sys.argv[1])"
    run = subprocess.run(
        [sys.executable, "-c", code, out], cwd=copy, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    return next(out.glob("*.tar.gz"))


def test_sdist_is_complete(sdist, tracked):
    with tarfile.open(sdist) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    assert tracked <= held


@pytest.mark.slow
def test_tests_run_from_the_sdist(sdist, tmp_path):
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    root = next(tmp_path.iterdir())
    some = ["tests/test_mesh.py", "tests/test_readme.py", "tests/test_packaging.py", "tests/test_imports.py"]
    command = [sys.executable, "-m", "pytest", "-q", *some]
    run = subprocess.run(command, cwd=root, capture_output=True, text=True, timeout=600, check=False)
    assert run.returncode == 0, run.stdout


def test_version_stands_once():
    assert PROJECT["version"] == qc.__version__
    assert (
        re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)[1] == qc.__version__
    )
    recipe = (ROOT / "docs" / "packaging" / "recipe.yaml").read_text()
    assert re.search(r'version: "(.*)"', recipe)[1] == qc.__version__
    assert f"## [{qc.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


def listed(recipe, key):
    """Entries of a list of the recipe, variables replaced."""
    found = re.search(rf"\n( *){key}:\n((?:\1  - .*\n)+)", recipe)[2]
    python = re.search(r'python_min: "(.*)"', recipe)[1]
    return {line.replace("${{ python_min }}", python) for line in re.findall(r"- (.*)", found)}


def as_conda(requirements):
    found = (re.fullmatch(r"([\w-]+)(>=.*)", requirement).groups() for requirement in requirements)
    return {f"{ELSEWHERE.get(name, name)} {bound}" for name, bound in found}


def test_recipe_agrees_with_the_project():
    recipe = (ROOT / "docs" / "packaging" / "recipe.yaml").read_text()
    python = PROJECT["requires-python"]
    assert listed(recipe, "run") == {f"python {python}", *as_conda(PROJECT["dependencies"])}
    assert listed(recipe, "run_constraints") == as_conda(PROJECT["optional-dependencies"]["view"])
    lowest = python.removeprefix(">=")
    assert listed(recipe, "host") == {"pip", f"python {lowest}.*", *as_conda(BUILD["requires"])}
    scripts = {f"{name} = {target}" for name, target in PROJECT["scripts"].items()}
    assert listed(recipe, "entry_points") == scripts
    assert re.search(r"summary: (.*)", recipe)[1] == PROJECT["description"]
    assert re.search(r"license: (.*)", recipe)[1] == PROJECT["license"]
    assert (ROOT / re.search(r"license_file: (.*)", recipe)[1]).is_file()


def test_description_and_readme_hold_on_an_index_page():
    """The description has no link at all, the metadata no address: where this will live nobody knows yet."""
    text = (ROOT / PROJECT["readme"]).read_text()
    assert "](" not in text
    assert "urls" not in PROJECT
    assert (ROOT / PROJECT["readme"]).is_file()


def test_issue_forms_are_forms():
    forms = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))
    assert len(forms) == 4
    for form in forms:
        if form.stem != "config":
            text = form.read_text()
            assert re.search(r"^name: .+\ndescription: .+\nlabels: \[.+\]\nbody:\n", text), form.name
            assert len(set(re.findall(r"^    id: (.+)$", text, re.MULTILINE))) == text.count("- type:"), (
                form.name
            )
