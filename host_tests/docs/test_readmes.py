"""Every link in the documents has a target, and every list in them matches the files."""

import ast
import re
from pathlib import Path

import pytest
from kickstand_tools.cli.main import kickstand

ROOT = Path(__file__).resolve().parents[2]
FIRST, DEVICE, TOOLS, CONTRIBUTING = (
    ROOT / name for name in ("README.md", "firmware/README.md", "tools/README.md", ".github/CONTRIBUTING.md")
)
BEHIND = sorted([*ROOT.glob("firmware/docs/*.md"), *ROOT.glob("tools/docs/*.md"), *ROOT.glob("tools/*/README.md")])
DISPLAYS, HOW = (ROOT / "firmware" / "docs" / name for name in ("displays.md", "how-it-works.md"))
PAGES = [FIRST, DEVICE, TOOLS, CONTRIBUTING, ROOT / "firmware/FAQ.md", ROOT / "CHANGELOG.md", *BEHIND]
MOST_LINES = {FIRST: 130, DEVICE: 250, TOOLS: 200, ROOT / "firmware/docs/settings.md": 220}
WIDEST = 120  # characters in a line, except in tables, pictures and commands
# relative links to issues, releases and the site, which are valid wherever the project is hosted
OF_THE_REPOSITORY = re.compile(r"(\.\./){2,}(issues|releases|deployments)\b")
LINK = re.compile(r'\]\(([^)\s]+)\)|src="([^"]+)"')


def text_of(path):
    return path.read_text(encoding="utf-8")


def links(path):
    return [target or other for target, other in LINK.findall(text_of(path))]


def anchors(path):
    headings = re.findall(r"^#+ (.*)$", text_of(path), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_link_leads_somewhere(page):
    local = [link for link in links(page) if not (link.startswith("https://") or OF_THE_REPOSITORY.match(link))]
    assert local or page.name == "CHANGELOG.md"
    for link in local:
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_a_link_out_of_the_checkout_has_its_depth():
    """GitHub shows a file at OWNER/NAME/blob/BRANCH/PATH, and the issues at OWNER/NAME/issues. So a link to the issues
    leaves the page's own folders, and then BRANCH and blob. GitHub also shows the first page at OWNER/NAME."""
    for page in PAGES:
        for link in filter(OF_THE_REPOSITORY.match, links(page)):
            assert link.count("../") == 1 + len(page.relative_to(ROOT).parts), link


def leads_to(page):
    return {(page.parent / link.partition("#")[0]).resolve() for link in links(page)}


def test_every_page_is_linked_from_the_first_or_its_own():
    assert leads_to(FIRST) >= set(PAGES) - {FIRST} - set(BEHIND)
    for page in DEVICE, TOOLS:
        assert leads_to(page) >= {behind for behind in BEHIND if behind.is_relative_to(page.parent)}


@pytest.mark.parametrize("page", sorted({*MOST_LINES, *BEHIND}), ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_page_has_a_readable_length(page):
    assert len(text_of(page).splitlines()) <= MOST_LINES.get(page, 200)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_line_of_prose_is_too_wide(page):
    prose = [line for line in text_of(page).splitlines() if not line.startswith(("|", "    ", "![", "<img", "`"))]
    assert [line for line in prose if len(line) > WIDEST] == []


def test_every_picture_is_shown():
    pictures = {(page.parent / link).resolve() for page in PAGES for link in links(page) if "pictures/" in link}
    assert pictures == {path.resolve() for path in (ROOT / "tools" / "pictures").iterdir()}


def test_the_first_page_is_short_and_begins_with_an_animation():
    text = text_of(FIRST)
    assert re.findall(r'src="([^"]+)"', text)[0].endswith(".webp")
    assert "    python3 tools/dev.py demo\n" in text
    assert "    python3 tools/dev.py test " in text_of(CONTRIBUTING)


def test_how_right_it_is_stands_in_both_places_alike():
    """The rows of the table on the first page are also in the complete table."""
    heads, *rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text_of(HOW).partition("| profile | shown")[2].partition("\n\n")[0].splitlines()
    ]
    figures = [[row[1], row[3], row[4], row[6]] for row in rows[1:]]
    assert "complementary" in heads[5]
    section = text_of(FIRST).partition("## How right it is")[2]
    pictures = [
        line.strip("|").split("|")[1:] for line in section.splitlines() if line.startswith("|") and "**" in line
    ]
    assert [[cell.strip() for cell in row] for row in pictures] == figures


PACKAGES = (
    "firmware/kickstand",
    "tools/kickstand_tools",
    "tools/kickstand_sim",
    "tools/fleet/kickstand_fleet",
    "tools/workshop/kickstand_workshop",
)


@pytest.mark.parametrize("package", PACKAGES)
def test_the_map_has_every_folder_and_no_other(package):
    name = package.rpartition("/")[2]
    drawn = re.split(rf"^ .*\b{name}/(?=\s)", text_of(CONTRIBUTING), maxsplit=1, flags=re.MULTILINE)[1]
    drawn = re.split(r"\n {4}\w", drawn)[0]  # keep the lines of this folder, up to the next top folder
    mapped = set(re.findall(r"\b(\w+)/(?=,| )", drawn.split("\n", 1)[1]))
    folders = {path.parent for path in (ROOT / package).rglob("*.py")} - {ROOT / package}
    assert mapped == {folder.relative_to(ROOT / package).parts[0] for folder in folders}


def test_every_file_that_is_pointed_to_is_there():
    for name in re.findall(r"`((?:firmware|tools|host_tests)/[\w/]+\.py)`", "".join(map(text_of, PAGES))):
        assert (ROOT / name).is_file(), name


def test_every_command_is_described():
    text = text_of(TOOLS)
    for name in kickstand.list_commands(None):
        command = kickstand.get_command(None, name)
        for words in [f"{name} {sub}" for sub in getattr(command, "commands", {})] or [name]:
            assert f"`{words}`" in text, words


def test_every_menu_entry_is_described():
    screen = ast.parse(text_of(ROOT / "firmware" / "kickstand" / "ui" / "menu.py"))
    (listed,) = [node for node in ast.walk(screen) if isinstance(node, ast.FunctionDef) and node.name == "_entries"]
    tuples = [node for node in ast.walk(listed) if isinstance(node, ast.Tuple) and node.elts]
    entries = {tuple_.elts[0].value for tuple_ in tuples if isinstance(tuple_.elts[0], ast.Constant)}
    assert len(entries) == 9
    text = text_of(DISPLAYS)
    assert not [entry for entry in entries if f"`{entry}`" not in text]
