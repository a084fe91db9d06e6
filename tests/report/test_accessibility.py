"""A report, a page of branches and axe-core: no violation of WCAG 2 in either theme."""

import pytest

from gaitopt import WalkProblem, compass_biped
from gaitopt.report import write_branch_page
from tests.docs.accessibility import find_violations
from tests.report.test_branch_page import shorten_diagram


@pytest.fixture(scope="module")
def branch_file(tmp_path_factory):
    """Return a page of two branches with two gaits each."""
    diagram = shorten_diagram()
    walker = WalkProblem(robot=compass_biped(), parameters=diagram.parameters)
    return write_branch_page(diagram, walker, tmp_path_factory.mktemp("branches") / "page.html")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["report_file", "branch_file"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_page_violates_no_rule_of_accessibility(browser, name, scheme, request):
    pytest.importorskip("axe_playwright_python", reason="needs the Python package axe-playwright-python")
    context = browser.new_context(color_scheme=scheme, bypass_csp=True, offline=True)
    page = context.new_page()
    page.goto(request.getfixturevalue(name).as_uri())
    violations = find_violations(page)
    context.close()
    assert violations == []
