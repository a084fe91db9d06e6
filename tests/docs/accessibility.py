"""Checks of pages in a browser: accessibility by axe-core, width, pictures and their size, and requests to other hosts.

``python -m tests.docs.accessibility build/docs`` checks the pages of a built site, in the light theme at the width of a
screen and in the dark theme at that of a phone, and lists what is wrong; the exit status is 1 if anything is.  Names of
pages, such as ``index.html``, restrict the check to them.
"""

import functools
import http.server
import shutil
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

VIEWS = (("light", 1280), ("dark", 390))
"""Theme and width [px]."""

SKIPPED = ("generated/api/", "search.html", "genindex.html", "py-modindex.html", "_static/")
"""Pages made by Sphinx alone."""

THEME = (".headerlink", ".copybtn", ".bd-header", ".bd-sidebar-primary", ".bd-sidebar-secondary", ".prev-next-footer")
TABLES = (".dataframe",)
"""Parts of a page that other packages make: the theme of the site, and tables of pandas in notebooks."""

OVERFLOW = "document.documentElement.scrollWidth > innerWidth"
BROKEN = "[...document.images].filter(image => image.complete && !image.naturalWidth).map(image => image.src)"
REDUCED = """[...document.querySelectorAll(".bd-article img")]
    .filter(image => image.alt && image.naturalWidth > image.clientWidth && !image.closest("a"))
    .map(image => `${image.src} is reduced and no link to its full size`)"""


def find_violations(page, excluded=()):
    """Return the violations of WCAG 2 on a page, one sentence each, with the first elements that violate the rule."""
    from axe_playwright_python.sync_playwright import Axe

    result = Axe().run(page, context={"exclude": [[part] for part in excluded]}).response
    return [
        f"{rule['id']}: {rule['help']}: {[node['html'][:120] for node in rule['nodes'][:3]]}"
        for rule in result["violations"]
    ]


def check_site(view, site, names=()):
    """Return what is wrong with the pages of a site in a view, one line each."""
    from playwright.sync_api import sync_playwright

    every = [path.relative_to(site).as_posix() for path in sorted(site.rglob("*.html"))]
    names = names or [name for name in every if not name.startswith(SKIPPED)]
    handler = functools.partial(QuietHandler, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server, sync_playwright() as driver:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/"
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        faults = list(check_view(browser, address, names, *view))
        browser.close()
        server.shutdown()
    return faults


def check_view(browser, address, names, theme, width):
    """Yield what is wrong with pages in a theme and at a width."""
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=theme, bypass_csp=True)
    foreign = []

    def serve(route):
        """Answer requests to the site only, as for a reader without a network; record the others."""
        if route.request.url.startswith(address):
            return route.continue_()
        foreign.append(route.request.url)
        return route.abort()

    context.route("**/*", serve)
    page = context.new_page()
    for name in names:
        foreign.clear()
        page.goto(address + name)
        faults = find_violations(page, (*THEME, *TABLES)) + page.evaluate(BROKEN) + page.evaluate(REDUCED)
        faults += ["the page is wider than the screen"] if page.evaluate(OVERFLOW) else []
        faults += [f"the page needs {url}" for url in foreign]
        yield from (f"{name}, {theme}, {width} px: {fault}" for fault in faults)
    context.close()


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    """A server of files that writes no log."""

    def log_message(self, *_):
        """Write nothing."""


if __name__ == "__main__":
    check = functools.partial(check_site, site=Path(sys.argv[1]).resolve(), names=sys.argv[2:])
    with ProcessPoolExecutor(len(VIEWS)) as pool:
        lines = [line for faults in pool.map(check, VIEWS) for line in faults]
    print(*lines, sep="\n", end="\n" if lines else "")
    sys.exit(bool(lines))
