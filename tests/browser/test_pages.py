"""Pages that `linkwork` writes, opened and used in a headless browser.

A page must stand alone: nothing is fetched, nothing is written to the console, no script fails.
"""

import os
import pathlib
import subprocess

import pytest
from playwright.sync_api import sync_playwright

SOURCE = pathlib.Path(os.environ["LINKWORK_SOURCE"])
PICTURES = pathlib.Path(os.environ["LINKWORK_PICTURES"])


def linkwork(*args: object) -> str:
    command = [os.environ["LINKWORK_PROGRAM"], *map(str, args)]
    done = subprocess.run(command, cwd=SOURCE, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def browser():
    flags = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
    flags += ["--disable-component-update", "--disable-sync"]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=os.environ["LINKWORK_BROWSER"], args=flags)
        yield chromium
        chromium.close()


@pytest.fixture
def opened(browser, request):
    """A function that opens a file; afterwards a picture is kept and whatever went wrong is told."""
    page = browser.new_page(viewport={"width": 1600, "height": 1000})
    wrong = []
    page.on("console", lambda message: wrong.append(f"console: {message.text}"))
    page.on("pageerror", lambda error: wrong.append(f"script: {error}"))

    def fetched(route):
        address = route.request.url
        if address.startswith("file:"):
            return route.continue_()
        wrong.append(f"fetched: {address}")
        return route.abort()

    page.route("**/*", fetched)

    def open_file(file: pathlib.Path):
        page.goto(file.as_uri())
        return page

    yield open_file
    page.screenshot(path=PICTURES / f"{request.node.name}.png")
    page.close()
    assert not wrong, wrong


def graph(tmp_path: pathlib.Path, simulation: str) -> pathlib.Path:
    file = tmp_path / "graph.html"
    file.write_text(linkwork("graph", f"sims/{simulation}", "--format", "html"))
    return file


def boxes(page) -> list[str]:
    """Paths of the boxes that are drawn: the title of each."""
    return page.eval_on_selector_all("#graph g.box > title", "all => all.map(t => t.textContent)")


def test_a_graph_is_searched_and_a_part_shown_with_its_wires(opened, tmp_path):
    page = opened(graph(tmp_path, "rover_traverse"))
    assert page.title().endswith("Linkwork")
    page.fill("#search", "wheel1.motor")
    assert page.inner_text("#tree li:first-child").startswith("1 of ")
    page.click("#tree li:nth-child(2) span:first-child")
    assert page.inner_text("#about h3") == "Rover.Hardware.Wheels.Wheel1.Motor"
    about = page.inner_text("#about")
    assert "actuators.dc_motor" in about and "Inputs" in about and "Outputs" in about
    # The choice of a part unfolds the boxes around it, and the link of a wire leads to the
    # neighbour.
    assert "Rover.Hardware.Wheels.Wheel1.Motor" in boxes(page)
    neighbours = page.eval_on_selector_all("#about a", "all => all.map(a => a.textContent)")
    other = next(n for n in neighbours if n != "Rover.Hardware.Wheels.Wheel1.Motor")
    page.click(f"#about a:text-is('{other}') >> nth=0")
    assert page.inner_text("#about h3") == other
    page.fill("#search", "no such part")
    assert page.inner_text("#tree").startswith("0 of ")


def test_a_graph_folds_and_unfolds(opened, tmp_path):
    page = opened(graph(tmp_path, "rover_traverse"))
    page.fill("#search", "")
    page.click("#tree li:has(> span:text-is('Rover')) > span:text-is('Rover') >> nth=0")
    folded = boxes(page)
    assert "Rover.Hardware" in folded, folded
    page.dblclick("#tree span:text-is('Hardware')")
    unfolded = boxes(page)
    assert "Rover.Hardware" not in unfolded and any(b.startswith("Rover.Hardware.") for b in unfolded)
    assert len(unfolded) > len(folded)
    # A box of the drawing unfolds in the same way.
    page.locator("#graph g.box:has(> title:text-is('Rover.Hardware.Wheels'))").dispatch_event("dblclick")
    assert any(b.startswith("Rover.Hardware.Wheels.Wheel1") for b in boxes(page))
    page.dblclick("#tree span:text-is('Hardware')")
    assert sorted(boxes(page)) == sorted(folded)


def test_a_graph_is_zoomed_and_moved(opened, tmp_path):
    page = opened(graph(tmp_path, "pendulum"))
    view = lambda: [float(v) for v in page.get_attribute("#graph", "viewBox").split()]
    before = view()
    page.mouse.move(800, 500)
    page.mouse.wheel(0, -100)
    page.wait_for_function("w => +document.getElementById('graph').getAttribute('viewBox').split(' ')[2] < w", arg=before[2])
    near = view()
    assert near[3] < before[3]
    page.mouse.down()
    page.mouse.move(900, 500, steps=3)
    page.mouse.up()
    assert view()[0] < near[0] and view()[1] == pytest.approx(near[1])


def test_phases_of_a_mission_are_entered(opened, tmp_path):
    page = opened(graph(tmp_path, "mars_edl"))
    names = page.eval_on_selector_all("#phases button", "all => all.map(b => b.textContent)")
    assert len(names) > 5
    parts = set()
    for name in names:
        page.click(f"#phases button:text-is('{name}')")
        assert page.inner_text("#phases button.on") == name
        assert "when" in page.inner_text("#next") or page.inner_text("#next") == "the last phase"
        parts.add(page.inner_text("#about h3"))
    assert len(parts) > 1, "every phase shows the same parts"


# The script lists texts that stick out of their drawings, and how far (pixels).
STICK_OUT = """() => [...document.querySelectorAll('svg text')].flatMap(t => {
    const [a, b] = [t.getBoundingClientRect(), t.ownerSVGElement.getBoundingClientRect()];
    const out = Math.max(b.left - a.left, a.right - b.right, b.top - a.top, a.bottom - b.bottom);
    return out > 1 ? [t.textContent + ': ' + out.toFixed(1)] : [];
})"""


def test_a_report_of_a_campaign_is_whole(opened, tmp_path):
    shipped = SOURCE / "sims" / "ballistic_entry"
    text = (shipped / "dispersions.ron").read_text()
    assert "runs: 1000," in text and '"sim.ron"' in text
    file, folder = tmp_path / "few.ron", tmp_path / "report"
    file.write_text(text.replace("runs: 1000,", "runs: 60,").replace('"sim.ron"', f'"{shipped / "sim.ron"}"'))
    linkwork("campaign", file, "--out", folder)
    page = opened(folder / "report.html")
    assert "60 of " in page.inner_text("body")
    titles = page.eval_on_selector_all("svg", "all => all.map(s => s.getAttribute('aria-label'))")
    for wanted in ["Distribution", "Sensitivity (rank correlation)"]:
        assert titles.count(wanted) >= 3, titles
    assert page.locator("svg circle.dot").count() >= 60
    assert page.locator("svg path.ring").count() >= 3
    assert page.evaluate(STICK_OUT) == []
    page.screenshot(path=PICTURES / "report_whole.png", full_page=True)


def test_plots_of_a_run_are_drawn(opened, tmp_path):
    linkwork("run", "sims/pendulum", "--until", "5s", "--quiet", "--out", tmp_path / "run")
    page = opened(tmp_path / "run" / "plots.svg")
    assert page.locator("text").count() > 5
    drawn = page.eval_on_selector_all("path, polyline", "all => all.filter(p => p.getTotalLength() > 300).length")
    assert drawn >= 1
