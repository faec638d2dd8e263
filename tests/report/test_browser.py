"""The report in headless Chromium; needs Debian's `chromium` and
`poppler-utils` and the extra `browser`.
"""

import shutil
import subprocess

import pytest

from wearsim.report.pdf import write_pdf

pytestmark = pytest.mark.browser


OPEN = "() => document.querySelectorAll('details').forEach(one => one.open = true)"
"""Opens all folds of a page."""


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

    page.evaluate(OPEN)
    figures = page.locator("figure")
    assert figures.count() >= 9
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
    assert page.locator("nav a").count() >= 8  # the appendix is one
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
    page.evaluate(OPEN)
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
    assert page.pdf(format="A4", prefer_css_page_size=True).startswith(b"%PDF")
    page.close()


def test_the_summary_prints_on_two_pages_with_numbers(drawn_directory, tmp_path):
    """The engineer's part begins on page three; each page has its number."""
    folder = shutil.copytree(drawn_directory, tmp_path / "run")
    texts = pages_of(write_pdf(folder / "report.html", shutil.which("chromium")))
    for index, text in enumerate(texts, start=1):
        assert f"Page {index} of {len(texts)}" in text
    assert "Approved" in texts[1]
    assert "For engineers" in texts[2]


def pages_of(path):
    """Texts of the pages of a PDF, by poppler."""
    program = shutil.which("pdftotext")
    assert program, "pdftotext is not installed (Debian: apt install poppler-utils)"
    done = subprocess.run(
        [program, str(path), "-"], capture_output=True, text=True, check=True
    )
    return done.stdout.split("\f")[:-1]


def test_tables_are_cards_on_a_phone(browser, drawn_directory):
    """Each row is a block of its own in which each value has its heading, and values
    under one head stand below it on a line each.
    """
    page = opened(browser, drawn_directory, 390)
    row = page.locator("#table-verdict tbody tr").nth(1)
    assert row.evaluate("row => getComputedStyle(row).display") == "block"

    def written(place):
        return row.locator("td").evaluate_all(
            f"all => all.map(one => getComputedStyle(one, '::{place}').content)"
        )

    assert written("before")[:3] == ['"Rig"', '"Field"', '"Ratio"']
    above = written("after")
    assert above[0].startswith('"Equal distance, ')
    assert above[3].startswith('"Equal worn depth, ')
    assert {above[k] for k in (1, 2, 4, 5)} == {"none"}
    heights = row.locator("td").evaluate_all("all => all.map(one => one.offsetHeight)")
    line = heights[1]
    assert heights[1:3] == heights[4:6] == [line, line]
    assert max(heights[0], heights[3]) <= 2 * line
    wide = page.evaluate(
        "() => [...document.querySelectorAll('.scroll')].filter(one => "
        "one.scrollWidth > one.clientWidth + 1).map(one => one.textContent.slice(0, 60))"
    )
    assert wide == []
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
