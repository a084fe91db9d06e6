"""Pages: links lead somewhere, and what is made from the code is whole.  Code blocks are separate tests."""

import ast
import json
import re
import runpy
import urllib.parse
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import basin, rimless_wheel
from gaitopt.cli.app import app
from gaitopt.stability.recovery import Recovery
from gaitopt.study import RobustnessMargins, RobustnessRecord, save_robustness
from gaitopt.study.basins.branch_basin import VARIABLES
from gaitopt.tuning.controller_family import FamilySettings
from gaitopt.tuning.record import Trial, Tuning
from gaitopt.tuning.tuning_file import save_tuning
from tests.docs.checked_commands import CHECKED, REDUCED, read_arguments

ROOT = Path(__file__).parents[2]
GENERATED = ROOT / "docs" / "generated"
PAGES = [*ROOT.glob("*.md"), *(page for page in (ROOT / "docs").rglob("*.md") if GENERATED not in page.parents)]
LINK = re.compile(r"(?<!\\)\]\(([^)\s]+)\)")


@pytest.fixture(scope="module")
def generated(tmp_path_factory):
    """Return the text of every page that is made from the code, by its path."""
    folder = tmp_path_factory.mktemp("docs") / "generated"
    runpy.run_path(str(ROOT / "docs" / "generated_pages.py"))["write"](folder)
    return {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in folder.rglob("*.[mr]*")}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page, generated):
    base = GENERATED / page.stem if page.stem.endswith("_head") else page.parent  # heads become parts of such pages
    base = {"gallery_head": GENERATED / "gallery", "errors_head": GENERATED}.get(page.stem, base)
    for link in LINK.findall(page.read_text(encoding="utf-8")):
        target = urllib.parse.unquote(link.partition("#")[0])
        if not target or target.startswith(("http://", "https://")):
            continue
        path = Path(*(base / target).parts)
        resolved = path.resolve()
        made = GENERATED in resolved.parents and resolved.relative_to(GENERATED).as_posix() in generated
        assert made or resolved.exists(), f"{page.name} links to {link}"


def test_every_page_of_the_site_can_be_reached(generated):
    trees = "\n".join(
        re.sub(r"^:.*\n", "", tree, flags=re.MULTILINE)
        for page in [*(ROOT / "docs").rglob("*.md")]
        for tree in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    )
    entries = {Path(line.strip()).stem for line in trees.splitlines()}
    own = {page.stem for page in PAGES if (ROOT / "docs") in page.parents and not page.stem.endswith("_head")}
    assert own - entries <= {"index"}


def test_every_public_name_is_in_the_reference(generated):
    text = "\n".join(page for name, page in generated.items() if name.startswith("api/"))
    names = re.findall(r"auto(?:class|function):: (gaitopt[\w.]*)\.(\w+)", text)
    assert {name for package, name in names if package == "gaitopt"} == set(gaitopt.__all__)
    wings = [path.parent.name for path in (ROOT / "gaitopt").glob("*/__init__.pyi")]
    every = {name for wing in wings for name in import_module(f"gaitopt.{wing}").__all__}
    assert {name for _, name in names} >= every | set(gaitopt.__all__)


def test_every_command_is_on_its_page(generated):
    import typer

    for name, command in typer.main.get_command(app).commands.items():
        part = generated["command_line.md"].split(f"## gaitopt {name}\n")[1].split("\n## ")[0]
        for parameter in command.params:
            if parameter.param_type_name == "option" and parameter.name != "help":
                assert ", ".join(f"`{option}`" for option in parameter.opts) in part
        examples = part.split("```")[1].splitlines()[1:]
        assert all(line.startswith(f"gaitopt {name}") for line in filter(None, examples))


def test_every_status_and_stop_is_in_the_error_index(generated):
    for kind in (*gaitopt.Status, *gaitopt.Stop):
        assert f"`{kind.key}`" in generated["errors.md"]
    assert "Attributes" not in generated["errors.md"]  # sections of docstrings would be one line of text in a table


def messages():
    """Return every text of the package, with … where a value is filled in."""
    found = []
    for path in (ROOT / "gaitopt").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = [part.value if isinstance(part, ast.Constant) else "…" for part in node.values]
                found.append("".join(map(str, parts)))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return found


def test_messages_in_the_error_index_are_what_gaitopt_says():
    listed = re.findall(r"^\| `(.*?)` \|", (ROOT / "docs/errors_head.md").read_text(encoding="utf-8"), re.MULTILINE)
    known = messages()
    for message in listed:
        first = message.split(". ")[0].replace("'frction'", "…").replace("'…'", "…")  # one sentence of it
        pattern = ".*".join(re.escape(part.strip()) for part in re.split(r"…", first) if part.strip(" .,:;()"))
        assert any(re.search(pattern, text, re.DOTALL) for text in known), message
    assert len(listed) > 8


def list_keys(facts, skipped):
    """Return all keys of nested data but those of mappings by the names of gains, actuators, laws or reasons."""
    if isinstance(facts, list):
        return set().union(*(list_keys(part, skipped) for part in facts))
    if not isinstance(facts, dict):
        return set()
    named = {name for name, part in facts.items() if name in skipped and isinstance(part, dict)}
    parts = [list(part.values()) if name in named else part for name, part in facts.items()]
    return set(facts) | list_keys(parts, skipped)


@pytest.mark.parametrize("kind", ["tuned gains", "push test", "basin", "basins of a branch"])
def test_the_page_of_file_formats_describes_all_that_files_contain(kind, tmp_path):
    recovery = Recovery(radius=0.1, starts=4, returned=3, steps=30, tolerance=1e-4, settling=(5, 9, 7))
    path = tmp_path / "file.json"
    if kind == "tuned gains":
        tuned = Tuning(
            family="joint_pd",
            law=None,
            gains={"stiffness": 30.0},
            settings=FamilySettings(torque_limit={"ankle": 8.0}),
            objective="spectral radius",
            radius_before=0.7,
            radius_after=0.5,
            cycle=None,
            fixed_point_shift=0.0,
            evaluations=1,
            verified=recovery,
            trials=(Trial({"stiffness": 30.0}, 0.5),),
            seconds=1.0,
        )
        names = list_keys(json.loads(save_tuning(tuned, path).read_text()), {"gains", "torque_limit"})
    elif kind == "push test":
        margins = (RobustnessMargins("push", 0.1, None, "rad/s"),)
        limits = {"ankle": 6.0}
        record = RobustnessRecord(
            law="lqr", radius=0.4, steps=50, margins=margins, recoveries={"lqr": recovery}, torque_limits=limits
        )
        skipped = {"recoveries", "torque_limits", "failures", "ends"}
        names = list_keys(json.loads(save_robustness(record, path).read_text()), skipped)
    elif kind == "basin":
        table = basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": np.linspace(0.1, 3, 3)})
        names = {*table.data_vars, "coordinate"}
    else:
        names = VARIABLES | {"stable"}
    text = (ROOT / "docs/file_format.md").read_text(encoding="utf-8")
    described = set(re.findall(r"`(\w+)`", text.partition("## Basins")[2].partition("## Other formats")[0]))
    assert names - described == set()
    assert len(names) > 3


def test_every_script_is_in_the_gallery(generated):
    scripts = {path.stem for path in (ROOT / "problems").glob("*.py")}
    scripts |= {path.stem for path in (ROOT / "problems/studies").glob("*.py") if "def study(" in path.read_text()}
    assert {Path(name).stem for name in generated if name.startswith("gallery/")} == scripts | {"index"}
    for name in scripts:
        page = generated[f"gallery/{name}.md"]
        for image in re.findall(r"\(images/(.*?)\)", page):
            assert (ROOT / "docs/images" / image).is_file()


def test_every_script_has_a_thumbnail_and_facts_in_the_gallery(generated):
    index = generated["gallery/index.md"]
    thumbnails = re.findall(r"\(images/(thumbnails/.*?)\)", index)
    assert len(thumbnails) == len([name for name in generated if name.startswith("gallery/")]) - 1
    assert all((ROOT / "docs/images" / name).is_file() for name in thumbnails)
    assert index.count("Processor time: ") == len(list((ROOT / "problems").glob("*.py")))


def test_the_start_page_moves_only_for_readers_who_accept_motion():
    page = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    still, moving = re.findall(r"_static/(walk\.\w+)", page)
    assert f'<source media="(prefers-reduced-motion: reduce)" srcset="_static/{still}">' in page
    assert (ROOT / "docs/static" / still).suffix == ".png"
    assert (ROOT / "docs/static" / moving).stat().st_size < 400_000
    assert re.search(r'<img [^>]*alt="[^"]{40,}"', page)


def test_every_script_that_a_page_names_exists():
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    named = {
        name for page in pages for name in re.findall(r"\bproblems/[a-z0-9_/]+\.py\b", page.read_text(encoding="utf-8"))
    }
    assert len(named) > 3
    assert not [name for name in sorted(named) if not (ROOT / name).is_file()]


@pytest.mark.parametrize("command", [*CHECKED, *REDUCED])
def test_every_command_that_runs_otherwise_is_on_one_page(command):
    lines = [line for page in PAGES for line in page.read_text(encoding="utf-8").splitlines()]
    assert sum(line.startswith(command) for line in lines) == 1


def test_reduced_options_follow_those_of_the_page():
    page = "gaitopt pareto problems/compass_slip.py --objectives cost,peak_torque --points 4 -o front.nc"
    assert read_arguments(page)[-6:] == ["-o", "front.nc", "--points", "2", "--workers", "1"]
    assert read_arguments("gaitopt --version  # comment") == ["gaitopt", "--version"]


def test_every_image_has_a_script():
    pages = [path.read_text(encoding="utf-8") for path in (ROOT / "docs").rglob("*.md")]
    images = {name for page in pages for name in re.findall(r"images/(\w+)\.png", page)}
    figures = set(
        re.findall(r'^    "(\w+)": ', (ROOT / "docs/make_figures.py").read_text(encoding="utf-8"), re.MULTILINE)
    )
    studies = {f"study_{path.stem}" for path in (ROOT / "problems/studies").glob("*.py")}
    assert {"compass_design", "study_compass_branches"} <= images
    assert images <= figures | studies


def test_the_build_of_the_site_runs_every_cell_and_fails_with_it():
    """Nothing else runs the notebooks."""
    lines = ast.parse((ROOT / "docs" / "conf.py").read_text(encoding="utf-8")).body
    settings = {
        line.targets[0].id: line.value.value
        for line in lines
        if isinstance(line, ast.Assign) and isinstance(line.value, ast.Constant)
    }
    execution = {name: value for name, value in settings.items() if name.startswith("nb_execution")}
    assert execution == {"nb_execution_mode": "force", "nb_execution_raise_on_error": True, "nb_execution_timeout": 180}
    assert "nb_execution_excludepatterns" not in ast.unparse(lines)
    assert settings["smartquotes_action"] == "qe"  # no dashes in place of the hyphens of options
