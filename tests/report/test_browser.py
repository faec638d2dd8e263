"""The report in headless Chromium; needs Debian's `chromium` and the extra `browser`."""

import shutil

import pytest

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium")
    assert program, "chromium is not installed (Debian: apt install chromium)"
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu"])
        yield running
        running.close()


@pytest.mark.parametrize("width", [1200, 390])
def test_report_opens_without_a_fault(browser, drawn_directory, width):
    page = browser.new_page(viewport={"width": width, "height": 900})
    faults = []
    page.on(
        "console",
        lambda message: faults.append(message.text) if message.type in ("error", "warning") else None,
    )
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("requestfailed", lambda request: faults.append(f"failed: {request.url}"))
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((drawn_directory / "report.html").as_uri())
    page.wait_for_load_state("networkidle")
    assert faults == []
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []

    figures = page.locator("figure")
    assert figures.count() >= 12
    for index in range(figures.count()):
        figure = figures.nth(index)
        name = figure.get_attribute("id")
        box = figure.locator("svg").first.bounding_box()
        assert box, name
        assert box["width"] > 200, name
        assert box["height"] > 80, name
        drawn = figure.locator("svg").first.evaluate(
            "svg => [...svg.querySelectorAll('path')].filter(p => p.getTotalLength() > 20).length"
        )
        assert drawn >= 4, name
        assert figure.locator("figcaption").inner_text().strip(), name

    tables = page.locator("table")
    assert tables.count() >= 4
    ragged = page.evaluate(
        """() => [...document.querySelectorAll('table')].flatMap(table => {
          const span = row => [...row.cells].reduce((n, cell) => n + cell.colSpan, 0);
          const rows = [...table.querySelectorAll('tbody tr')];
          const width = span(table.querySelector('thead tr'));
          return rows.filter(r => span(r) !== width || [...r.cells].some(c => !c.textContent.trim()))
                     .map(r => table.id + ': ' + r.textContent.trim());
        })"""
    )
    assert ragged == []
    overflow = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    assert overflow <= 0, "the page must not scroll sideways"
    page.close()


def test_links_of_the_contents_lead_somewhere(browser, drawn_directory):
    page = browser.new_page()
    page.goto((drawn_directory / "report.html").as_uri())
    dead = page.evaluate(
        "() => [...document.querySelectorAll('a[href^=\"#\"]')]"
        ".filter(a => !document.querySelector(a.getAttribute('href'))).map(a => a.textContent)"
    )
    assert dead == []
    assert page.locator("nav a").count() >= 10
    page.close()
