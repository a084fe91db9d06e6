"""A report and axe-core: no violation of WCAG 2 in either theme."""

import pytest

from tests.docs.accessibility import find_violations


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_report_violates_no_rule_of_accessibility(browser, report_file, scheme):
    pytest.importorskip("axe_playwright_python", reason="needs the Python package axe-playwright-python")
    context = browser.new_context(color_scheme=scheme, bypass_csp=True, offline=True)
    page = context.new_page()
    page.goto(report_file.as_uri())
    violations = find_violations(page)
    context.close()
    assert violations == []
