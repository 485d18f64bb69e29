"""The page in a browser, used by mouse and keyboard."""

from __future__ import annotations

import json
import shutil
from itertools import pairwise

import numpy as np
import pytest
from maps import differences, is_like, made_up, on_ellipsoid, on_pillow, pixels

from quadcurv import QuadMesh, viewing
from quadcurv.comparison import compare
from quadcurv.viewing import Fields
from quadcurv.viewing import page as page_module


@pytest.fixture(scope="module")
def pillow():
    return on_pillow()


@pytest.fixture(scope="module")
def ellipsoid():
    return on_ellipsoid()


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if shutil.which("chromedriver") is None or shutil.which("chromium") is None:
        pytest.skip("not installed: chromium and chromium-driver")
    webdriver = pytest.importorskip("selenium.webdriver")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for argument in (
        "headless=new",
        "no-sandbox",
        "use-angle=swiftshader",
        "enable-unsafe-swiftshader",
        "window-size=1000,700",
        "host-resolver-rules=MAP * ~NOTFOUND",
    ):
        options.add_argument(f"--{argument}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    driver = webdriver.Chrome(options, service)
    yield driver
    driver.quit()


class Page:
    """The page of a comparison in the browser, used by mouse and keyboard."""

    def __init__(self, browser, path):
        from selenium.webdriver import ActionChains

        self.browser, self.actions = browser, lambda: ActionChains(browser)
        browser.get_log("browser"), browser.get_log("performance")
        browser.get(path.as_uri())

    def all(self, selector):
        return self.browser.find_elements("css selector", selector)

    def text(self, selector):
        return self.all(selector)[0].text

    def press(self, key):
        self.actions().send_keys(key).perform()

    def pictures(self, path):
        """Of every view: its pixels below the title, as the screen shows them."""
        self.browser.save_screenshot(str(path))
        screen = pixels(path)
        boxes = [v.rect for v in self.all("#views > div")]
        return [
            screen[int(b["y"]) + 25 : int(b["y"] + b["height"]), int(b["x"]) : int(b["x"] + b["width"])]
            for b in boxes
        ]


@pytest.fixture
def page(browser, ellipsoid, tmp_path):
    viewing.save_maps(ellipsoid, tmp_path / "map.html", "mean_curvature")
    return Page(browser, tmp_path / "map.html")


def coloured(picture):
    return np.ptp(picture, axis=2) > 30


def test_page_has_a_view_a_scheme_and_a_legend(page, tmp_path):
    assert [v.text for v in page.all("#views > div")] == ["finite_volume", "liu", "cotan-6"]
    for picture in page.pictures(tmp_path / "screen.png"):
        assert coloured(picture).mean() > 0.15
    assert page.text("#name") == "mean curvature H (1/length)"
    boxes = [t.rect for t in page.all("#ticks span")]
    assert len(boxes) == 5
    for left, right in pairwise(boxes):
        assert left["x"] + left["width"] < right["x"]


def test_dragging_turns_all_views_alike(page, tmp_path):
    before = page.pictures(tmp_path / "before.png")
    page.actions().click_and_hold(page.all("#views > div")[1]).move_by_offset(70, 30).release().perform()
    after = page.pictures(tmp_path / "after.png")
    for old, new in zip(before, after, strict=True):
        assert differences(old, new)[1] > 0.05
    shapes = [coloured(p) for p in after]
    shapes = [s[: min(map(len, shapes)), : min(s.shape[1] for s in shapes)] for s in shapes]
    assert np.mean(shapes[0] != shapes[1]) < 0.1
    page.press("r")
    for old, new in zip(before, page.pictures(tmp_path / "reset.png"), strict=True):
        assert is_like(old, new)


def test_keys_and_the_list_choose_the_field(page):
    from selenium.webdriver import Keys

    page.press(Keys.ARROW_RIGHT)
    assert page.text("#name") == "error |H − exact| (1/length)"
    page.press(Keys.ARROW_LEFT)
    page.press(Keys.ARROW_LEFT)
    assert page.all("#field")[0].get_attribute("value") == "difference to cotan-6"
    assert page.text("#name").startswith("difference to cotan-6, |H")
    page.all("#field")[0].send_keys("valence")
    assert page.text("#name").startswith("valence")
    page.press(Keys.TAB)
    page.press("o")
    assert [p.text for p in page.all("#legend .below")] == ["valence < 4"]


def test_histograms_show_how_much_of_the_area_has_which_colour(page, ellipsoid):
    def heights():
        return [[b.rect["height"] for b in v.find_elements("css selector", ".bars > div")] for v in views]

    views = page.all("#views > div")
    assert heights() == [[], [], []]
    page.press("h")
    shown = Fields(ellipsoid).field("mean_curvature")
    expected = np.array([shown.histogram(s, ellipsoid.areas) for s in ellipsoid.schemes])
    found = np.array(heights())
    np.testing.assert_allclose(found / found.max(), expected / expected.max(), atol=0.02)
    page.press("h")
    assert heights() == [[], [], []]


def test_a_click_tells_the_value_in_every_scheme(page, ellipsoid, tmp_path):
    page.actions().move_to_element(page.all("#views > div")[2]).click().perform()
    kind, vertex, _, valence = page.text("#picked").replace(",", "").split()
    assert kind == "vertex"
    assert int(valence) == ellipsoid.valence[int(vertex)]
    for box in page.all("#views > div"):
        name, value = box.text.split(": ")
        assert float(value.replace("−", "-")) == pytest.approx(
            ellipsoid.mean_curvature[name][int(vertex)], rel=1e-3
        )
    for picture in page.pictures(tmp_path / "ring.png"):
        red, green, blue = np.moveaxis(picture, 2, 0)
        assert np.sum((red > green + 60) & (blue > green + 40)) > 50  # the ring
    page.actions().move_to_element_with_offset(page.all("#views > div")[0], -150, -100).click().perform()
    assert page.text("#picked") == ""


def test_page_of_cells(browser, pillow, tmp_path):
    viewing.save_maps(pillow, tmp_path / "cells.html", "error")
    page = Page(browser, tmp_path / "cells.html")
    page.actions().move_to_element(page.all("#views > div")[0]).click().perform()
    kind, cell, *_ = page.text("#picked").replace(",", "").split()
    assert kind == "cell"
    page.press("o")
    assert [p.text for p in page.all("#legend .below")] == ["seam"]
    for picture in page.pictures(tmp_path / "seam.png"):
        assert np.sum(np.abs(picture - [0xE6, 0x9F, 0]).max(axis=2) < 12) > 200  # over the edges of cells
    name, value = page.text("#views > div").split(": ")
    expected = abs(pillow.errors[name].ravel()[int(cell)])
    assert float(value) == pytest.approx(expected, rel=1e-3)


def test_page_marks_boundaries_and_what_is_undefined(browser, tmp_path):
    strip = made_up(a=[1.0] * 20 + [np.nan] * 20, b=[-2.0] * 40)
    viewing.save_maps(strip, tmp_path / "strip.html", "mean_curvature")
    page = Page(browser, tmp_path / "strip.html")
    assert [p.text for p in page.all("#legend .below")] == ["undefined"]
    page.press("o")
    assert [p.text for p in page.all("#legend .below")] == ["undefined", "boundary"]
    found = set()
    middle = page.all("#views > div")[0]
    for x, y in ((-60, -14), (-60, 14), (60, -14), (60, 14)):  # the strip is seen at an angle
        page.actions().move_to_element_with_offset(middle, x, y).click().perform()
        found.add(tuple(box.text for box in page.all("#views > div")))
    assert {("a: 1.000", "b: −2.000"), ("a: undefined", "b: −2.000")} <= found


def test_page_needs_no_network_and_logs_no_error(page):
    assert page.browser.get_log("browser") == []
    messages = [json.loads(entry["message"])["message"] for entry in page.browser.get_log("performance")]
    asked = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    assert asked
    assert all(url.startswith("file:") for url in asked)


def test_no_name_of_a_scheme_breaks_the_page(browser, tmp_path):
    name = "</script><b>@DATA@"
    viewing.save_maps(made_up(**{name: [1.0, 2.0, 3.0, 4.0]}), tmp_path / "name.html")
    assert Page(browser, tmp_path / "name.html").text("#views > div") == name


def test_valence_and_values_beyond_what_a_byte_and_single_precision_hold(browser, tmp_path):
    """A fan of 300 triangles 1e-45 across: H and its scale are of 1e45, positions far below 1e-38."""
    t = 2 * np.pi * np.arange(300) / 300
    rim = np.stack((np.cos(t), np.sin(t), 0 * t), axis=-1)
    fan = [[300, k, (k + 1) % 300] for k in range(300)]
    small = QuadMesh(1e-45 * np.vstack((rim, [[0, 0, 0.2]])), fan)
    found = compare(small, ["cotan-6"])
    height = found.mean_curvature["cotan-6"][300]
    assert height > 1e43
    viewing.save_maps(found, tmp_path / "fan.html", "mean_curvature")
    page = Page(browser, tmp_path / "fan.html")
    page.actions().move_to_element_with_offset(page.all("#views > div")[0], 0, 0).click().perform()
    assert page.text("#picked") in ("vertex 300, valence 300", "")
    page.browser.execute_script("picked = 300; report();")
    assert page.text("#picked") == "vertex 300, valence 300"
    assert float(page.text("#views > div").split(": ")[1]) == pytest.approx(height, rel=1e-3)
    assert coloured(page.pictures(tmp_path / "fan.png")[0]).mean() > 0.01


def test_style_of_a_page(browser, ellipsoid, tmp_path):
    style = viewing.Style(
        camera=(0, 0, 1), limits=(1e-4, 2e-2), colours="magma", title="A <b>title</b>", shading=True
    )
    viewing.save_maps(ellipsoid, tmp_path / "page.html", "error", style)
    page = Page(browser, tmp_path / "page.html")
    assert page.text("h1") == page.browser.title == "A <b>title</b>"
    ticks = [t.text.strip("≤≥ ") for t in page.all("#ticks span")]
    assert ticks == ["1e-4", "1e-3", "2.0e-02"]
    lit = page.pictures(tmp_path / "lit.png")
    page.press("s")
    for bright, dark in zip(page.pictures(tmp_path / "plain.png"), lit, strict=True):
        assert dark.sum() < bright.sum()
        assert (dark <= bright + 1).mean() > 0.99
    assert page.browser.get_log("browser") == []


def test_a_large_page_is_thinned_and_says_so(monkeypatch, ellipsoid, tmp_path):
    whole = viewing.html_page(ellipsoid)
    monkeypatch.setattr(page_module, "LIMIT", len(whole.text) - 1)
    with pytest.warns(UserWarning, match=r"386 vertices would take more than .* MB: without difference to"):
        thinned = viewing.html_page(ellipsoid)
    assert len(thinned.text) < len(whole.text)
    monkeypatch.setattr(page_module, "LIMIT", 0)
    with pytest.warns(UserWarning, match=r"without mean_curvature, .*, and it still takes 0 MB"):
        least = viewing.html_page(ellipsoid, "error")
    data = json.loads(least.text.split('id="data">')[1].split("</script>")[0])
    assert [f["name"] for f in data["fields"]] == ["error"]


def test_page_in_a_notebook(ellipsoid):
    page = viewing.html_page(ellipsoid)
    assert repr(page).startswith("Page(0.")
    frame = page._repr_html_()
    assert frame.startswith('<iframe srcdoc="&lt;!doctype html&gt;')
    assert frame.count('"') == 10  # quotes of the page do not end its own
