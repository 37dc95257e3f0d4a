"""The three READMEs: every link leads somewhere, and what they list is what there is."""

import ast
import re
from pathlib import Path

import pytest
from kickstand_tools.cli.main import kickstand

ROOT = Path(__file__).resolve().parents[2]
READMES = [ROOT / "README.md", ROOT / "firmware" / "README.md", ROOT / "tools" / "README.md"]
LINK = re.compile(r'\]\(([^)\s]+)\)|src="([^"]+)"')


def text_of(path):
    return path.read_text(encoding="utf-8")


def links(path):
    return [one or other for one, other in LINK.findall(text_of(path))]


def anchors(path):
    headings = re.findall(r"^#+ (.*)$", text_of(path), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("readme", READMES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_link_leads_somewhere(readme):
    found = [link for link in links(readme) if not link.startswith("https://")]
    assert found
    for link in found:
        name, _, anchor = link.partition("#")
        target = readme.parent / name if name else readme
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_every_picture_is_shown():
    shown = {(readme.parent / link).resolve() for readme in READMES for link in links(readme) if "pictures/" in link}
    assert shown == {path.resolve() for path in (ROOT / "tools" / "pictures").iterdir()}


def test_the_first_page_is_short_and_has_both_commands():
    text = text_of(READMES[0])
    assert len(text.splitlines()) < 230
    assert "    python3 tools/dev.py demo\n" in text
    assert "    python3 tools/dev.py test\n" in text


PACKAGES = "firmware/kickstand", "tools/kickstand_tools", "tools/workshop/kickstand_workshop"


@pytest.mark.parametrize("package", PACKAGES)
def test_the_map_has_every_folder_and_no_other(package):
    name = package.rpartition("/")[2]
    drawn = re.split(rf"^ .*\b{name}/(?=\s)", text_of(READMES[0]), maxsplit=1, flags=re.MULTILINE)[1]
    drawn = re.split(r"\n {4}\w", drawn)[0]  # until the next top folder
    mapped = set(re.findall(r"\b(\w+)/(?=,| )", drawn.split("\n", 1)[1]))
    folders = {path.parent for path in (ROOT / package).rglob("*.py")} - {ROOT / package}
    assert mapped == {folder.relative_to(ROOT / package).parts[0] for folder in folders}


def test_every_file_that_is_pointed_to_is_there():
    for name in re.findall(r"`((?:firmware|tools|host_tests)/[\w/]+\.py)`", "".join(map(text_of, READMES))):
        assert (ROOT / name).is_file(), name


def test_every_command_is_described():
    text = text_of(READMES[2])
    for name in kickstand.list_commands(None):
        command = kickstand.get_command(None, name)
        for words in [f"{name} {sub}" for sub in getattr(command, "commands", {})] or [name]:
            assert f"`{words}`" in text, words


def test_every_menu_entry_is_described():
    screen = ast.parse(text_of(ROOT / "firmware" / "kickstand" / "ui" / "screen.py"))
    (listed,) = [node for node in ast.walk(screen) if isinstance(node, ast.FunctionDef) and node.name == "_entries"]
    tuples = [node for node in ast.walk(listed) if isinstance(node, ast.Tuple) and node.elts]
    entries = {tuple_.elts[0].value for tuple_ in tuples if isinstance(tuple_.elts[0], ast.Constant)}
    assert len(entries) == 8
    text = text_of(READMES[1])
    assert not [entry for entry in entries if f"`{entry}`" not in text]
