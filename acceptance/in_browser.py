"""Opens a run's report.html in headless Chromium, without a network.

    in_browser.py OUTPUTS PICTURES [PAGE_OF_MANY]

Clicks on a rock and finds its crops, its residuals and its covariance; moves, zooms, toggles layers
and the theme by pointer and by keys; expects no message on the console and no request. Measures
the first paint, and frames while panning. PICTURES is where screenshots go, in light and dark.
PAGE_OF_MANY is a page of 50,000 rocks, which has to be as quick.
"""

import json
import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

MAX_FIRST_PAINT_MS = 2000
MAX_MEDIAN_FRAME_MS = 16.0
MAX_BYTES = 3_000_000


def expect(what, found, expected=True):
    if found != expected:
        sys.exit(f"{what}: found {found!r}, expected {expected!r}")


def opened(browser, path, scheme="light", **context):
    """The page, and everything it should not have done."""
    # What one sees: device pixels and a window of a laptop.
    context = browser.new_context(
        viewport={"width": 1400, "height": 900}, color_scheme=scheme, offline=True, **context
    )
    page = context.new_page()
    faults = []
    page.on("console", lambda message: faults.append(f"console: {message.text}"))
    page.on("pageerror", lambda error: faults.append(f"error: {error}"))
    first = [path.resolve().as_uri()]
    page.on(
        "request",
        lambda request: None
        if request.url.startswith("data:") or request.url in first
        else faults.append(f"request: {request.url[:100]}"),
    )
    page.goto(first[0])
    page.wait_for_selector("html[data-ready]", timeout=20_000)
    return page, faults


def time_of(page, mark):
    """When the page had this paint or mark, ms after it was asked for."""
    return page.evaluate("(mark) => performance.getEntriesByName(mark)[0]?.startTime ?? null", mark)


def map_bytes(page):
    """What the canvas shows, to tell whether it changed."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return page.evaluate("() => document.getElementById('map').toDataURL()")


def rock_on_screen(page, index):
    """Where a rock is in the window."""
    return page.evaluate(
        """(i) => {
            const [x, y] = map.pixelOf(ROCKS.east_m[i], ROCKS.north_m[i]);
            const box = map.canvas.getBoundingClientRect();
            return [box.left + x, box.top + y];
        }""",
        index,
    )


def check_rock(page, name, with_crops):
    """A click on a rock shows what it rests on."""
    index = page.evaluate("(name) => ROCKS.id.indexOf(name)", name)
    # In the middle no panel lies over it.
    page.evaluate("(i) => { [map.x, map.y] = [ROCKS.east_m[i], ROCKS.north_m[i]]; map.repaint(); }", index)
    page.mouse.click(*rock_on_screen(page, index))
    expect("rock chosen", page.inner_text("#rock h2"), name)
    panel = page.inner_text("#rock")
    for part in ["1-sigma ellipse", "Seen by", "Covariance", "cm²", "Detections and residuals"]:
        expect(f"{name}: says {part}", part in panel)
    figures = page.locator("#rock .crops figure")
    wanted = page.evaluate("(i) => DATA.crops.filter((c) => c.rock === i).length", index)
    expect(f"{name}: crops", figures.count(), wanted)
    if with_crops:
        expect(f"{name}: has crops", wanted > 0)
        images = page.evaluate(
            """async () => {
                const sizes = [];
                for (const image of document.querySelectorAll("#rock .crops image")) {
                    const picture = new Image();
                    picture.src = image.href.baseVal;
                    await picture.decode();
                    sizes.push(picture.naturalWidth);
                }
                return sizes;
            }"""
        )
        expect(f"{name}: crops are pictures", len(images) == wanted and all(w > 8 for w in images))
        label = page.locator("#rock .crops svg").first.get_attribute("aria-label")
        expect(f"{name}: a crop has words", name in label)


def check_controls(page):
    """Layers, zoom, keys and theme change what is shown."""
    page.evaluate("() => map.fit()")
    before = map_bytes(page)
    box = page.locator("#layer-coverage")
    if box.is_enabled():
        box.click()
        without = map_bytes(page)
        expect("toggling a layer changes the map", without != before)
        box.click()
        expect("toggling it twice does not", map_bytes(page), before)
    scale = "() => map.scale"
    was = page.evaluate(scale)
    middle = page.locator("#map").bounding_box()
    page.mouse.move(middle["x"] + middle["width"] / 2, middle["y"] + middle["height"] / 2)
    page.mouse.wheel(0, -400)
    map_bytes(page)
    expect("the wheel zooms in", page.evaluate(scale) > 1.5 * was)
    page.focus("#map")
    page.keyboard.press("0")
    expect("0 shows everything", abs(page.evaluate(scale) / was - 1) < 1e-9)
    page.keyboard.press("ArrowLeft")
    expect("an arrow moves the map", map_bytes(page) != before)
    page.keyboard.press("Home")
    page.keyboard.press("Escape")
    expect("Escape lets go", page.locator("#rock h2").count(), 0)
    page.keyboard.press("n")
    expect("N goes to a rock", page.inner_text("#rock h2"), page.evaluate("() => ROCKS.id[0]"))
    page.keyboard.press("p")
    last = page.evaluate("() => ROCKS.id.at(-1)")
    expect("P goes to the one before", page.inner_text("#rock h2"), last)
    expect("what is chosen is announced", last in page.inner_text("#said"))
    page.fill("#find-id", "no such rock")
    page.keyboard.press("Enter")
    expect("an unknown name is told", page.inner_text("#said"), "No rock is called no such rock.")
    paper = "() => getComputedStyle(document.body).backgroundColor"
    was = page.evaluate(paper)
    page.click("#theme")
    expect("the theme changes", page.evaluate(paper) != was)
    page.click("#theme")
    expect("and back", page.evaluate(paper), was)


def check_accessible(page):
    """Every control has a name, and Tab reaches the map and the panel."""
    nameless = page.evaluate(
        """() => [...document.querySelectorAll("button, input, canvas, [role=img]")]
            .filter((e) => !(e.ariaLabel || e.labels?.length || e.textContent.trim()))
            .map((e) => e.outerHTML.slice(0, 80))"""
    )
    expect("controls without a name", nameless, [])
    reached = set()
    page.focus(".skip")
    for _ in range(25):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("() => document.activeElement.id"))
    missing = {"theme", "map", "zoom-in", "layer-rocks", "find-id", "next"} - reached
    expect("controls that Tab does not reach", missing, set())


def check_charts(page):
    """Both axes of every chart are named, and no number on them is missing."""
    nameless = page.evaluate(
        """() => [...document.querySelectorAll("figure.chart")]
            .filter((figure) => [...figure.querySelectorAll("svg text.name")].filter((name) => name.textContent.trim()).length !== 2
                || /NaN|undefined|Infinity/.test(figure.textContent))
            .map((figure) => figure.querySelector("figcaption").textContent)"""
    )
    expect("charts without a name on both axes", nameless, [])
    if page.evaluate("() => typeof VIEWS !== 'undefined' && !VIEWS.correction.every(Number.isNaN)"):
        titles = page.locator("#poses figcaption").all_inner_texts()
        for title in ["Corrections of position", "Corrections of attitude"]:
            expect(f"pose corrections: {title}", title in titles)


def check_changes(page, with_map):
    """The section on what changed says how many are the same, and leads to the rocks that are new."""
    counts = page.evaluate("() => JSON.parse(document.getElementById('data').textContent).changes.summary.counts")
    said = page.inner_text("#changes .tiles")
    for status, count in counts.items():
        expect(f"changes: says {status}", f"{count:,}\n {status}" in said or f"{count:,} {status}" in said.replace("\n", " "))
    expect("changes: a map", page.locator("#changes figure.broad path.spots").count() > 0)
    if with_map and counts["new"]:
        page.evaluate("() => { for (const list of document.querySelectorAll('#changes details')) list.open = true; }")
        link = page.locator("#changes button.link").last
        name = link.inner_text()
        link.click()
        expect("changes: a click chooses the rock", page.inner_text("#rock h2"), name)


def frames(page):
    """Script and whole frames while panning, milliseconds: (median script, median, 95th, longest)."""
    return page.evaluate(
        """async () => {
            const frame = () => new Promise((done) => requestAnimationFrame(done));
            const median = (v, share = 0.5) => v.sort((a, b) => a - b)[Math.floor(share * (v.length - 1))];
            await frame();
            const script = [];
            const gaps = [];
            const draw = map.draw.bind(map);
            map.draw = () => {
                const start = performance.now();
                draw();
                script.push(performance.now() - start);
            };
            let last = await frame();
            for (let i = 0; i < 180; i++) {
                map.pan(6 * Math.cos(i / 15), 6 * Math.sin(i / 15));
                const now = await frame();
                gaps.push(now - last);
                last = now;
            }
            delete map.draw;
            return [median(script), median(gaps), median(gaps, 0.95), Math.max(...gaps)];
        }"""
    )


# What a panned map shows: everything, or as many rocks as are still drawn each by itself.
VIEWPOINTS = {
    "everything": "() => map.fit()",
    "single rocks": """() => {
        map.fit();
        while (map.rocks.count(...map.window(200)) > MANY) map.zoom(1.1);
    }""",
    "all layers": """() => {
        map.fit();
        for (const box of document.querySelectorAll("#layers input:not(:checked):enabled")) box.click();
    }""",
}


def measure(browser, path, max_bytes):
    size = path.stat().st_size
    page, faults = opened(browser, path)
    paint, drawn = time_of(page, "first-contentful-paint"), time_of(page, "map drawn")
    rocks = page.evaluate("() => N_ROCKS")
    print(f"{path}: {rocks} rocks, {size / 1e6:.2f} MB, first paint {paint:.0f} ms, map {drawn:.0f} ms")
    expect(f"{path}: size", size <= max_bytes)
    expect(f"{path}: first paint", max(paint, drawn) < MAX_FIRST_PAINT_MS)
    for name, viewpoint in VIEWPOINTS.items():
        page.evaluate(viewpoint)
        script, median, slow, longest = frames(page)
        print(
            f"  panning {name}: median frame {median:.1f} ms, {script:.1f} ms of it script; "
            f"95 % {slow:.1f} ms, longest {longest:.1f} ms"
        )
        expect(f"{path}: {name}: median frame", median <= MAX_MEDIAN_FRAME_MS)
    expect(f"{path}", faults, [])


def renderer(browser):
    page = browser.new_page()
    gpu = page.evaluate(
        """() => {
            const gl = document.createElement("canvas").getContext("webgl");
            const info = gl && gl.getExtension("WEBGL_debug_renderer_info");
            return info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "software (no WebGL)";
        }"""
    )
    page.close()
    return gpu


def main():
    outputs, pictures = Path(sys.argv[1]), Path(sys.argv[2])
    many = Path(sys.argv[3]) if len(sys.argv) > 3 else None
    report = outputs / "report.html"
    listed = json.loads((outputs / "run.json").read_text())["outputs"]
    expect("run.json lists the report", "report.html" in listed)
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        print(f"Chromium {browser.version}, renderer {renderer(browser)}")
        pictures.mkdir(parents=True, exist_ok=True)
        for scheme in ["light", "dark"]:
            page, faults = opened(browser, report, scheme)
            check_charts(page)
            with_map = page.evaluate("() => typeof N_ROCKS !== 'undefined'")
            if page.locator("#changes").is_visible():
                check_changes(page, with_map)
            rocks = page.evaluate("() => N_ROCKS") if with_map else 0
            if rocks:
                with_crops = page.evaluate("() => DATA.crops.length") > 0
                name = page.evaluate("() => ROCKS.id[DATA.crops[0]?.rock ?? map.nearest()]")
                check_rock(page, name, with_crops)
                check_controls(page)
                check_accessible(page)
            page.screenshot(path=pictures / f"report-{scheme}.png", full_page=True)
            expect(f"{report}: {scheme}", faults, [])
        if many:
            page, faults = opened(browser, many)
            check_rock(page, page.evaluate("() => ROCKS.id[map.nearest()]"), False)
            page.screenshot(path=pictures / "report-of-many.png")
            expect(f"{many}", faults, [])
        browser.close()
        if not with_map:
            return
        # Without the 60 frames a second of a screen, a frame takes what script and paint take.
        unpaced = ["--no-sandbox", "--disable-frame-rate-limit", "--disable-gpu-vsync"]
        browser = playwright.chromium.launch(executable_path=chromium, args=unpaced)
        measure(browser, report, MAX_BYTES)
        if many:
            measure(browser, many, 16_000_000)
        browser.close()


main()
