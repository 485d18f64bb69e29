"""The page in a browser, used by mouse and keyboard."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
from maps import differences, is_like, made_up, on_ellipsoid, on_pillow, pixels

from quadcurv import QuadMesh, surfaces, viewing
from quadcurv.comparison import compare
from quadcurv.viewing import Fields
from quadcurv.viewing import page as page_module


@pytest.fixture(scope="module")
def pillow():
    return on_pillow()


@pytest.fixture(scope="module")
def ellipsoid():
    return on_ellipsoid()


class Page:
    """The page of a comparison in the browser, used by mouse and keyboard."""

    def __init__(self, browser, path, address=""):
        from selenium.webdriver import ActionChains

        self.browser, self.actions = browser, lambda: ActionChains(browser)
        browser.get("about:blank")  # or another address would load nothing
        browser.get_log("browser"), browser.get_log("performance")
        browser.get(f"{path.as_uri()}#{address}")
        self.drawn()

    def drawn(self):
        """Wait until what was asked for has been drawn: a screen's next picture but one."""
        self.browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")

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
    for left, right in itertools.pairwise(boxes):
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
    kind, vertex, _, valence, at = page.text("#picked").replace(",", "").replace("−", "-").split(maxsplit=4)
    assert kind == "vertex"
    assert int(valence) == ellipsoid.valence[int(vertex)]
    found = [float(x) for x in at.removeprefix("at (").removesuffix(")").split()]
    np.testing.assert_allclose(found, ellipsoid.mesh.points[int(vertex)], atol=1e-5)
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
    page = Page(browser, tmp_path / "strip.html", "camera=0,0,1&up=0,1,0")
    assert [p.text for p in page.all("#legend .below")] == ["undefined"]
    page.press("o")
    assert [p.text for p in page.all("#legend .below")] == ["undefined", "boundary"]
    found = set()
    middle = page.all("#views > div")[0]
    for x, y in itertools.product((-60, 60), range(0, 40, 8)):
        page.actions().move_to_element_with_offset(middle, x, y).click().perform()
        found.add(tuple(box.text for box in page.all("#views > div")))
    assert {("a: 1", "b: −2"), ("a: undefined", "b: −2")} <= found


def test_page_needs_no_network_and_logs_no_error(page):
    assert page.browser.get_log("browser") == []
    messages = [json.loads(entry["message"])["message"] for entry in page.browser.get_log("performance")]
    asked = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    assert asked
    assert all(url.startswith("file:") for url in asked)


def test_address_holds_field_camera_range_size_and_schemes(browser, ellipsoid, tmp_path):
    path = tmp_path / "map.html"
    viewing.save_maps(ellipsoid, path, "mean_curvature")
    said = "field=error&camera=0,0,2&up=0,1,0&zoom=1.5&range=1e-3,1e-2&size=640,480"
    said += "&schemes=liu,cotan-6&show=histogram"
    page = Page(browser, path, said)
    assert [v.text for v in page.all("#views > div")] == ["liu", "cotan-6"]
    assert page.all("#field")[0].get_attribute("value") == "error"
    assert [t.text for t in page.all("#ticks span")] == ["≤ 1e-3", "≥ 1e-2"]
    assert page.browser.execute_script("return document.body.getBoundingClientRect().width") == 640
    assert page.browser.execute_script("return axes[2].concat(zoom)") == [0, 0, 1, 1.5]
    assert page.browser.execute_script("return switches.filter(id => element(id).checked)") == ["histogram"]
    address = page.browser.current_url.partition("#")[2]
    before = page.pictures(tmp_path / "before.png")
    for old, new in zip(before, Page(browser, path, address).pictures(tmp_path / "after.png"), strict=True):
        assert is_like(old, new)


@pytest.mark.parametrize(
    "wrong", ["field=none&camera=0,0,0&range=2,1&size=1,1&schemes=x", "range=-1,x&camera=a&zoom=0"]
)
def test_an_address_that_says_nothing_sensible_is_passed_over(browser, ellipsoid, tmp_path, wrong):
    path = tmp_path / "map.html"
    viewing.save_maps(ellipsoid, path)
    plain = Page(browser, path).pictures(tmp_path / "plain.png")
    page = Page(browser, path, wrong)
    for old, new in zip(plain, page.pictures(tmp_path / "other.png"), strict=True):
        assert is_like(old, new)
    assert page.browser.get_log("browser") == []


def test_range_and_size_are_set_in_the_page(page, tmp_path):
    from selenium.webdriver import Keys

    def enter(name, value):
        page.all(f"#{name}")[0].send_keys(Keys.CONTROL + "a" + Keys.NULL + value + Keys.TAB)

    page.all("summary")[0].click()
    page.all("#field")[0].send_keys("error")
    for name, value in (("low", "1e-3"), ("high", "0.02")):
        enter(name, value)
    assert [t.text for t in page.all("#ticks span")] == ["≤ 1e-3", "≥ 2e-2"]
    assert "range=0.001,0.02" in page.browser.current_url
    enter("high", "-1")  # no end of a scale of decades
    assert page.all("#high")[0].get_attribute("value") == "0.02"
    page.all("#automatic")[0].click()
    assert page.text("#ticks").splitlines()[-1] == "1e0"
    enter("width", "500")
    assert page.browser.execute_script("return document.body.getBoundingClientRect().width") == 500
    page.all("#fill")[0].click()
    assert "&size=" not in page.browser.current_url
    page.all("[data-towards='0,0,1']")[0].click()
    assert page.browser.execute_script("return axes[2]") == [0, 0, 1]


def test_what_no_scheme_enters_is_drawn_once_and_an_error_not_against_itself(page, tmp_path):
    page.all("#field")[0].send_keys("gaussian")
    assert [v.text for v in page.all("#views > div")] == ["K by jet"]
    assert len(page.pictures(tmp_path / "one.png")) == 1
    assert coloured(page.pictures(tmp_path / "one.png")[0]).mean() > 0.1
    page.browser.execute_script("show('difference to liu')")
    assert [v.text for v in page.all("#views > div")] == ["finite_volume", "cotan-6"]
    page.browser.execute_script("show('feature'); picked = 3; report();")
    assert page.text("#views > div") == "creases: smooth"
    assert [t.text for t in page.all("#ticks span")] == ["smooth", "crease"]


def test_ticks_and_values_are_those_of_pictures(page, ellipsoid):
    fields = Fields(ellipsoid)
    for name in fields.names:
        shown = fields.field(name)
        page.browser.execute_script(f"show({json.dumps(name)}); picked = 7; report();")
        found = page.browser.execute_script("return [...element('ticks').children].map(t => t.textContent)")
        assert found == [label for _, label in shown.ticks()], name
        patches = [p.text for p in page.all("#legend .below")]
        assert patches == [label for label, _ in shown.patches()]
        for box, (view, values) in zip(page.all("#views > div"), shown.values.items(), strict=True):
            assert box.text == f"{view}: {shown.text(values[7])}"


@pytest.mark.parametrize("width", [400, 800, 1600])
def test_page_is_usable_at_widths_from_400_to_1600(page, tmp_path, width):
    page.browser.set_window_size(width, 700)
    try:
        inside = page.browser.execute_script("return innerWidth")
        page.press("o")
        for selector in ("header > *", "#legend > *", "#picked"):
            for part in page.all(selector):
                if part.is_displayed():
                    box = part.rect
                    assert box["x"] >= 0
                    assert box["x"] + box["width"] <= inside + 1, selector
        for picture in page.pictures(tmp_path / "narrow.png"):
            assert coloured(picture).mean() > 0.05
            assert min(picture.shape[:2]) > 100
        visible = [t.rect for t in page.all("#ticks span") if t.is_displayed()]
        for left, right in itertools.pairwise(visible):
            assert left["x"] + left["width"] < right["x"]
    finally:
        page.browser.set_window_size(1000, 700)


def test_nothing_is_cut_when_turned(page, tmp_path):
    """The margin of every view stays white from wherever the surface is seen."""
    for camera in ([1, 0, 0], [0, 1, 0.1], [1, 1, 1], [-1, 2, 0.3]):
        page.browser.execute_script(f"look({camera}, [0, 0, 1]); draw();")
        for picture in page.pictures(tmp_path / "turned.png"):
            assert not coloured(picture[:, :3]).any()
            assert not coloured(picture[:, -3:]).any()
            assert not coloured(picture[-3:]).any()


def test_touch_turns_zooms_and_picks(page, tmp_path):
    """Events as a touch screen sends them: one finger turns, two zoom, a tap picks."""
    box = page.all("#views > div")[1].rect
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def touch(kind, *places):
        page.browser.execute_cdp_cmd(
            "Input.dispatchTouchEvent",
            {"type": kind, "touchPoints": [{"x": a, "y": b, "id": i} for i, (a, b) in enumerate(places)]},
        )

    def state():
        return page.browser.execute_script("return [axes.flat(), zoom, picked]")

    axes, zoom, _ = state()
    touch("touchStart", (x, y))
    touch("touchMove", (x + 60, y + 20))
    touch("touchEnd")
    turned, _, picked = state()
    assert np.abs(np.subtract(turned, axes)).max() > 0.1
    assert picked == -1
    touch("touchStart", (x - 40, y), (x + 40, y))
    touch("touchMove", (x - 80, y), (x + 80, y))
    touch("touchEnd")
    again, larger, picked = state()
    assert np.abs(np.subtract(turned, again)).max() < 1e-9
    assert larger == pytest.approx(2 * zoom, rel=0.05)
    assert picked == -1
    touch("touchStart", (x, y))
    touch("touchEnd")
    assert state()[2] >= 0
    assert page.text("#picked").startswith("vertex")


def test_a_page_is_thinned_on_request(monkeypatch, browser, tmp_path):
    surface = surfaces.torus()
    for layout, kind in (("faces", "vertex"), ("staggered", "cell")):
        mesh, xi, eta = surface.sample((40, 60), layout)
        found = compare(mesh, ["liu", "cotan-6"], surface.mean_curvature(xi, eta))
        whole = viewing.html_page(found, "error")
        monkeypatch.setattr(page_module, "LIMIT", len(whole.text) // 2)
        thinned = viewing.html_page(found, "error", viewing.Style(thin=True))
        assert len(whole.text) / 8 < len(thinned.text) < len(whole.text) / 2
        names = [[f["name"] for f in data(p)["fields"]] for p in (whole, thinned)]
        assert names[0] == names[1]
        monkeypatch.undo()
        thinned.save(tmp_path / "thin.html")
        page = Page(browser, tmp_path / "thin.html")
        for picture in page.pictures(tmp_path / "thin.png"):
            assert coloured(picture).mean() > 0.1
        page.browser.execute_script("picked = 11; report();")
        words = page.text("#picked").replace(",", "").split()
        assert words[0] == kind
        value = float(page.text("#views > div").split(": ")[1].replace("−", "-"))
        assert value == pytest.approx(abs(found.errors["liu"].ravel()[int(words[1])]), rel=1e-3)
        assert page.browser.get_log("browser") == []


def data(page):
    return json.loads(page.text.split('id="data">')[1].split("</script>")[0])


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
    page.browser.execute_script("picked = 300; report();")
    assert page.text("#picked") == "vertex 300, valence 300, at (0, 0, 2e−46)"
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
    assert ticks == ["1e-4", "1e-3", "2e-2"]
    lit = page.pictures(tmp_path / "lit.png")
    page.press("s")
    for bright, dark in zip(page.pictures(tmp_path / "plain.png"), lit, strict=True):
        assert dark.sum() < bright.sum()
        assert (dark <= bright + 1).mean() > 0.99
    assert page.browser.get_log("browser") == []


def test_a_large_page_leaves_out_fields_and_says_so(monkeypatch, ellipsoid, tmp_path):
    whole = viewing.html_page(ellipsoid)
    monkeypatch.setattr(page_module, "LIMIT", len(whole.text) - 1)
    with pytest.warns(UserWarning, match=r"386 vertices would take more than .* MB: without difference to"):
        smaller = viewing.html_page(ellipsoid)
    assert len(smaller.text) < len(whole.text)
    monkeypatch.setattr(page_module, "LIMIT", 0)
    with pytest.warns(UserWarning, match=r"without mean_curvature, .*, and it still takes 0 MB"):
        least = viewing.html_page(ellipsoid, "error")
    assert [f["name"] for f in data(least)["fields"]] == ["error"]


def test_page_in_a_notebook(ellipsoid):
    page = viewing.html_page(ellipsoid)
    assert repr(page).startswith("Page(0.")
    frame = page._repr_html_()
    assert frame.startswith('<iframe srcdoc="&lt;!doctype html&gt;')
    assert frame.count('"') == 10  # quotes of the page do not end its own


def test_page_in_a_frame_is_drawn_and_logs_no_error(browser, ellipsoid, tmp_path):
    """A frame of a notebook has no address of its own and may run scripts alone."""
    path = tmp_path / "notebook.html"
    path.write_text(f"<!doctype html><body>{viewing.html_page(ellipsoid)._repr_html_()}", encoding="utf-8")
    frame = Page(browser, path)
    browser.switch_to.frame(0)
    frame.drawn()
    browser.switch_to.default_content()
    browser.save_screenshot(str(tmp_path / "frame.png"))
    assert coloured(pixels(tmp_path / "frame.png")).mean() > 0.05
    browser.switch_to.frame(0)
    frame.all("#overlays")[0].click()
    assert [p.text for p in frame.all("#legend .below")] == ["valence < 4"]
    browser.switch_to.default_content()
    assert browser.get_log("browser") == []


def test_titles_have_room_above_low_views(browser, ellipsoid, tmp_path):
    viewing.save_maps(ellipsoid, tmp_path / "low.html", "mean_curvature")
    page = Page(browser, tmp_path / "low.html", "size=900,260&show=")
    for picture, view in zip(page.pictures(tmp_path / "low.png"), page.all("#views > div"), strict=True):
        title = view.find_elements("css selector", "span")[0].rect
        assert title["height"] > 10
        assert coloured(picture).mean() > 0.02
    screen = pixels(tmp_path / "low.png")
    for view in page.all("#views > div"):
        box, title = view.rect, view.find_elements("css selector", "span")[0].rect
        rows = slice(int(title["y"]), int(title["y"] + title["height"]))
        assert not coloured(screen[rows, int(box["x"]) : int(box["x"] + box["width"])]).any()
