"""The documents as pages of the site: all exist, every link has a target, and the pages are accessible."""

import re
from pathlib import Path
from urllib.parse import urljoin

import pytest
from kickstand_tools.web.documents import documents
from kickstand_tools.web.documents.markdown import converted
from support.web.rider import LAPTOP, PHONE, Rider

ROOT = Path(__file__).resolve().parents[2]
HOME = "https://an.example/kickstand"
TABLET = {"viewport": {"width": 820, "height": 1180}}
LOOKED_AT = "docs/device.html", "docs/how-it-works.html"


def pages(files):
    return {name: data.decode() for name, data in files.items() if name.startswith("docs/") and name.endswith(".html")}


def test_every_document_is_a_page():
    found = [
        *ROOT.glob("*.md"),
        *ROOT.glob(".github/*.md"),
        *(ROOT / "firmware").rglob("*.md"),
        *ROOT.glob("tools/*.md"),
    ]
    found += ROOT.glob("tools/docs/*.md")
    assert sorted(documents.PATHS) == sorted(path.relative_to(ROOT).as_posix() for path in found)
    assert len({documents.page_of(path) for path in documents.PATHS}) == len(documents.PATHS)


def test_every_link_of_a_page_leads_somewhere(files):
    """If the project's address is unknown, names of files outside the site are plain text, not links."""
    assert "config.py</a>" not in files["docs/settings.html"].decode()
    for name, text in pages(files).items():
        for link in re.findall(r'(?:href|src)="([^"]+)"', text):
            if link.startswith("https://"):
                continue
            target, _, anchor = urljoin(name, link).partition("#")
            target = target.lstrip("/") or "index.html"
            assert target in files, (name, link)
            assert not anchor or f'id="{anchor}"' in files[target].decode(), (name, link)


def test_links_lead_to_the_projects_files_if_its_home_is_known():
    made = {name: data.decode() for name, data in documents.document_files(HOME).items() if name.endswith(".html")}
    assert f'href="{HOME}/blob/main/firmware/config.py"' in made["docs/settings.html"]
    assert f'href="{HOME}/tree/main/firmware/examples"' in made["docs/your-own-code.html"]
    assert f'href="{HOME}/issues/new/choose"' in made["docs/faq.html"]


def test_a_page_lists_all_documents_and_its_own_headings(files):
    for name, text in pages(files).items():
        listed = re.findall(r'<a href="\./([\w-]+\.html)"', re.findall('<nav class="all".*?</nav>', text, re.S)[0])
        assert {f"docs/{page}" for page in listed} == set(pages(files))
        assert text.count('aria-current="page"') == 2, name
        here = re.findall('<nav class="here".*?</nav>', text, re.S)
        names = re.findall(r'<h3 id="([^"]+)"', text)
        if names and not name.endswith(documents.ALL):
            assert re.findall(r'class="level-2"><a href="#([^"]+)"', here[0]) == names


def test_one_page_has_all_the_words(files):
    """The page with all documents can be searched and printed. Each anchor's name occurs once."""

    def words(text):
        return re.sub(r"<[^>]+>", " ", re.findall("<article>(.*?)</article>", text, re.S)[0]).split()

    whole = files[f"docs/{documents.ALL}"].decode()
    single = [files[f"docs/{documents.page_of(path)}"].decode() for path in documents.PATHS]
    assert words(whole)[-sum(map(len, map(words, single))) :] == [word for text in single for word in words(text)]
    names = re.findall(r' id="([^"]+)"', whole)
    assert len(names) == len(set(names))


def test_a_documents_own_marks_do_no_harm():
    """The conversion handles quotes in a table, an empty table head, an angle bracket and a broken link."""
    made = converted('# A & B\n\n"one" < two\n\n| | b |\n|---|---|\n| [c](d.md) | `<x>` |\n', lambda link: None, str)
    assert (made.title, made.about) == ("A & B", '"one" < two')
    assert "<td></td>" in made.html and "<th>b</th>" in made.html
    assert "<td>c</td>" in made.html and "<code>&lt;x&gt;</code>" in made.html and "&lt; two" in made.html


@pytest.mark.parametrize(
    ("kind", "judged"), [(PHONE, LOOKED_AT[0]), (TABLET, ""), (LAPTOP, LOOKED_AT[1])], ids=["phone", "tablet", "laptop"]
)
def test_a_page_fits_and_axe_finds_nothing(chromium, address, kind, judged):
    rider = Rider(chromium, address + LOOKED_AT[0], **kind)
    for name in LOOKED_AT:
        rider.page.goto(address + name)
        assert rider.text("header nav [aria-current]") == "Docs"
        assert rider.fits()
        lists = rider.page.locator("nav.all:visible, nav.here:visible, .quick summary:visible").count()
        assert lists == 2
        assert name != judged or rider.axe() == []
    assert rider.errors == [] and rider.strangers() == []
    rider.context.close()


def test_on_a_phone_a_heading_is_two_touches_away(chromium, address):
    rider = Rider(chromium, address + LOOKED_AT[1], **PHONE)
    rider.page.tap(".quick summary:has-text('On this page')")
    rider.page.tap(".quick a:has-text('Glossary')")
    rider.page.wait_for_function("document.querySelector('#glossary').getBoundingClientRect().top < 200")
    rider.context.close()


def test_on_paper_there_is_the_text_alone(chromium, address):
    rider = Rider(chromium, address + LOOKED_AT[0], **LAPTOP)
    rider.page.set_viewport_size({"width": 673, "height": 1000})  # the width of A4 paper without margins
    rider.page.emulate_media(media="print", color_scheme="dark")
    hidden = rider.page.locator("header, footer, main nav, .quick").all()
    assert hidden and not any(one.is_visible() for one in hidden)
    assert rider.page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert rider.fits()
    cut = "all => all.filter((one) => one.scrollWidth > one.clientWidth + 1).length"
    assert rider.page.eval_on_selector_all("article .wide, article pre", cut) == 0
    rider.context.close()
