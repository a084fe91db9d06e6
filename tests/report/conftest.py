"""A page in a real browser, and what it complained about."""

import shutil
from dataclasses import dataclass, field

import pytest

from gaitopt import write_report

NAMES = ("chromium", "chromium-browser", "google-chrome")
VIEWPORTS = {"phone": {"width": 390, "height": 844}, "desktop": {"width": 1280, "height": 900}}


@pytest.fixture(scope="module")
def browser():
    """Return headless Chromium: that of the machine, never one downloaded."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs the Python package playwright")
    program = next((path for name in NAMES if (path := shutil.which(name))), None)
    if program is None:
        pytest.skip(f"needs one of {', '.join(NAMES)} on the PATH (Debian: apt-get install chromium)")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def report_file(tmp_path_factory, slipping, sticking):
    """Return a report on a gait that slips and on one that does not."""
    path = tmp_path_factory.mktemp("report") / "report.html"
    return write_report({"slipping": slipping, "sticking <b>": sticking}, path, title="Two gaits & more")


@dataclass
class Opened:
    """A page, and everything it complained about."""

    page: object
    complaints: list = field(default_factory=list)

    def first(self, selector):
        return self.page.locator(selector).first

    def slide_to(self, frame):
        """Move the time of the first player to a frame."""
        move = "(slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')); }"
        self.first(".time").evaluate(move, frame)

    def stage(self):
        """Return the picture of the first player as its markup."""
        return self.first(".stage").evaluate("stage => stage.outerHTML")


@pytest.fixture
def open_page(browser, report_file):
    """Return a function that opens the report in a window of a kind, without network."""
    pages = []

    def open_(viewport="desktop", scheme="light", file=report_file):
        context = browser.new_context(viewport=VIEWPORTS[viewport], color_scheme=scheme, offline=True)
        opened = Opened(context.new_page())
        opened.page.on("console", lambda message: opened.complaints.append(message.text))
        opened.page.on("pageerror", lambda error: opened.complaints.append(str(error)))
        opened.page.on("requestfailed", lambda request: opened.complaints.append(request.url))
        opened.page.goto(file.as_uri())
        pages.append((context, opened))
        return opened

    yield open_
    for context, opened in pages:
        context.close()
        assert opened.complaints == []
