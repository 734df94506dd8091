"""The site in a browser: opened, searched, followed, and read on a phone."""

import pytest

PHONE = {"width": 390, "height": 844}
READ_ON_A_PHONE = (
    "index.html", "five_minutes.html", "when.html", "method.html", "howto/file.html", "howto/robot.html",
    "gallery/index.html", "api/index.html", "api/generated/unconstrain.LocallyLinearPolicy.html",
    "reproduction/report.html", "models.html", "glossary.html", "changelog.html",
)  # fmt: skip


@pytest.fixture
def reader(chromium, address):
    """A page of which every request that leaves the site, and every error, is kept."""
    page = chromium.new_page(viewport={"width": 1300, "height": 900})
    page.faults = []
    page.on("request", lambda request: request.url.startswith((address, "data:"))
            or page.faults.append(request.url))  # fmt: skip
    page.on("response", lambda response: response.ok or response.status == 304
            or page.faults.append(response.url))  # fmt: skip
    page.on("pageerror", lambda error: page.faults.append(str(error)))
    yield page
    page.close()


def test_it_opens_and_its_first_links_lead_on(reader, address, screenshots):
    reader.goto(f"{address}/index.html")
    assert "unconstrain" in reader.title()
    reader.screenshot(path=screenshots / "site.png")
    links = reader.locator("article a.reference.internal").evaluate_all("each => each.map(a => a.href)")
    pages = list(dict.fromkeys(link.partition("#")[0] for link in links))[:5]
    assert len(pages) == 5
    for link in pages:
        reader.goto(link)
        assert reader.locator("article h1").first.inner_text()
    assert reader.faults == []


@pytest.mark.parametrize(
    ("words", "found"), [("free_probability", "LocallyLinearPolicy"), ("force sensor", "My force sensor")]
)
def test_a_search_finds_it(words, found, reader, address, screenshots):
    reader.goto(f"{address}/search.html?q={words.replace(' ', '+')}")
    results = reader.locator("#search-results li a")
    results.first.wait_for(timeout=20_000)
    reader.wait_for_function(
        "found => document.querySelector('#search-results').innerText.includes(found)", arg=found
    )
    reader.screenshot(path=screenshots / f"search-{words.split()[0]}.png")
    assert reader.faults == []


@pytest.mark.parametrize("name", READ_ON_A_PHONE)
def test_it_reads_on_a_phone(name, chromium, address, screenshots):
    page = chromium.new_page(viewport=PHONE)
    page.goto(f"{address}/{name}")
    width = page.evaluate("document.documentElement.scrollWidth")
    size = page.evaluate("parseFloat(getComputedStyle(document.querySelector('article p')).fontSize)")
    page.screenshot(path=screenshots / f"phone-{name.replace('/', '-').removesuffix('.html')}.png")
    page.close()
    assert width <= PHONE["width"]
    assert size >= 14
