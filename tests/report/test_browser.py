"""The report in headless Chromium; needs Debian's `chromium` and the extra
`browser`.
"""

import shutil

import pytest

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium")
    assert program, "chromium is not installed (Debian: apt install chromium)"
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(
            executable_path=program, args=["--no-sandbox", "--disable-gpu"]
        )
        yield running
        running.close()


@pytest.mark.parametrize("width", [1200, 900, 390])
def test_report_opens_without_a_fault(browser, drawn_directory, width):
    page = browser.new_page(viewport={"width": width, "height": 900})
    faults = []
    page.on(
        "console",
        lambda message: (
            faults.append(message.text)
            if message.type in ("error", "warning")
            else None
        ),
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
    assert figures.count() >= 11
    for index in range(figures.count()):
        figure = figures.nth(index)
        name = figure.get_attribute("id")
        box = figure.locator("svg").first.bounding_box()
        assert box, name
        assert box["width"] > 200, name
        assert box["height"] > 80, name
        drawn = figure.locator("svg").first.evaluate(
            "svg => [...svg.querySelectorAll('path')].filter(p => p.getTotalLength() "
            "> 20).length"
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
    overflow = page.evaluate(
        "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    )
    assert overflow <= 0, "the page must not scroll sideways"
    page.close()


def test_links_of_the_contents_lead_somewhere(browser, drawn_directory):
    page = browser.new_page()
    page.goto((drawn_directory / "report.html").as_uri())
    dead = page.evaluate(
        "() => [...document.querySelectorAll('a[href^=\"#\"]')].filter(a => "
        "!document.querySelector(a.getAttribute('href'))).map(a => a.textContent)"
    )
    assert dead == []
    assert page.locator("nav a").count() >= 10
    page.close()


def opened(browser, directory, width=900, **options):
    page = browser.new_page(viewport={"width": width, "height": 900}, **options)
    page.goto((directory / "report.html").as_uri())
    return page


A4 = {"width": 688, "height": 1016}
"""A4 less margins of 14 mm [px]."""


def test_it_prints_to_a4_without_cut_tables(browser, drawn_directory, tmp_path):
    page = opened(browser, drawn_directory, A4["width"])
    page.emulate_media(media="print")
    page.evaluate(
        "() => document.querySelectorAll('details').forEach(one => one.open = true)"
    )
    wide = page.evaluate(
        """() => [...document.querySelectorAll("table, figure svg, pre")].filter(one => one.offsetParent
          && one.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
          .map(one => one.id || one.textContent.slice(0, 60))"""
    )
    assert wide == []
    tall = page.evaluate(
        "() => [...document.querySelectorAll('figure')].map(one => one.offsetHeight)"
    )
    assert max(tall) < A4["height"]
    assert page.locator("#answer").bounding_box()["height"] < 0.93 * A4["height"], (
        "page one is one page"
    )
    assert not page.locator(".slider").is_visible()
    assert page.pdf(format="A4", prefer_css_page_size=True).startswith(b"%PDF")
    page.close()


def seen(page):
    """Numbers of the states whose lines are seen."""
    return page.evaluate(
        """() => [...new Set([...document.querySelectorAll("#figure-worn_profiles [id*='-state'] path")]
          .filter(line => getComputedStyle(line).strokeOpacity !== '0')
          .map(line => +line.parentElement.id.match(/-state(\\d+)-/)[1]))]"""
    )


def test_the_slider_shows_the_wheel_on_its_way(browser, drawn_directory):
    page = opened(browser, drawn_directory, 390)
    slider = page.locator(".slider input")
    assert slider.is_visible()
    last = int(slider.get_attribute("max"))
    assert seen(page) == [last]
    assert page.locator(".slider output").inner_text() == "rig 60.0 km, field 90.0 km"
    slider.fill("5")
    assert seen(page) == [5]
    assert page.locator(".slider output").inner_text() == "rig 30.0 km, field 45.0 km"
    page.close()


def test_page_one_is_complete_without_script(browser, drawn_directory):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((drawn_directory / "report.html").as_uri())
    assert not page.locator(".slider").is_visible()
    assert page.locator("#figure-worn_profiles figcaption").is_visible()
    context.close()
    page = opened(browser, drawn_directory)
    last = int(page.locator(".slider input").get_attribute("max"))
    assert seen(page) == [last]
    page.close()


def test_every_figure_has_an_alternative_text(browser, drawn_directory):
    page = opened(browser, drawn_directory)
    texts = page.evaluate(
        "() => [...document.querySelectorAll('figure [role=img]')].map(one => "
        "one.getAttribute('aria-label'))"
    )
    assert len(texts) == page.locator("figure svg").count()
    assert all(len(text.split()) > 4 for text in texts)
    page.close()
