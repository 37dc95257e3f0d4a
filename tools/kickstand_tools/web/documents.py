"""The documents of the project as pages of the site, in the folder docs/.

Headings get the same anchors as on GitHub.
"""

import itertools
import posixpath
import re
from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

from ..common import installation
from ..common.markup import filled

FOLDER = "docs/"  # in the site
ALL = "all.html"
_BETWEEN = "--"  # separates a document's name from an anchor, on the page with all documents
_TEMPLATE = Path(__file__).parent / "templates" / "document.html"
_BIKE = "settings displays rides live cars your-own-code how-it-works what-it-costs limits".split()
_COMPUTER = "recordings file-formats tracks-and-videos accuracy pages simulation fleets python security".split()
# The documents in reading order: (title of the group, paths in the project)
GROUPS = (
    ("Start", ["README.md"]),
    ("On the bike", ["firmware/README.md", *(f"firmware/docs/{name}.md" for name in _BIKE), "firmware/FAQ.md"]),
    ("On the computer", ["tools/README.md", *(f"tools/docs/{name}.md" for name in _COMPUTER)]),
    ("The project", [".github/CONTRIBUTING.md", "CHANGELOG.md"]),
)
PATHS = tuple(path for _, paths in GROUPS for path in paths)
_PICTURES = "tools/pictures"
_START = {"README.md": "index", "firmware/README.md": "device", "tools/README.md": "tools"}
# links to the project's own repository on GitHub
_OUTSIDE = re.compile(r"(?:\.\./){2,}(issues/.*|deployments/github-pages)$")
_IMAGE = re.compile(r'(<img [^>]*?src=")([^"]+)(")')
_SCROLLED = {"tabindex": "0", "role": "region"}  # content wider than a phone can be scrolled, by the keyboard too

Link = Callable[[str], str | None]


@dataclass
class Entry:
    title: str
    page: str
    path: str


@dataclass
class Heading:
    level: int  # 1 for the title
    name: str  # its anchor
    text: str  # its text without markup


@dataclass
class Document:
    title: str  # text of the first heading
    about: str  # text of the first paragraph
    headings: list[Heading]  # all headings except the title
    html: str  # the whole document


def page_of(path: str) -> str:
    """Return the name of a document's page in FOLDER.

    >>> page_of("firmware/README.md"), page_of("firmware/docs/live.md"), page_of("firmware/FAQ.md")
    ('device.html', 'live.html', 'faq.html')
    """
    return _START.get(path, posixpath.basename(path).removesuffix(".md").lower()) + ".html"


def document_files(home: str) -> dict[str, bytes]:
    """Return {path in the site: content} of the documents' pages, one page with all of them, and their pictures.

    home: the project's address. "" leaves out links to the project's other files and issues.
    """
    root = installation.documents()
    documents = {path: _converted(root, path, home) for path in PATHS}
    groups = [(title, [Entry(documents[path].title, page_of(path), path) for path in paths]) for title, paths in GROUPS]
    pages = {page_of(path): (document, path) for path, document in documents.items()}
    pages[ALL] = _on_one_page(root, home), ""
    files = {
        f"{FOLDER}{page}": filled(
            _TEMPLATE, document=document, path=path, groups=groups, home=home, start=page_of(PATHS[0]), all=ALL
        ).encode()
        for page, (document, path) in pages.items()
    }
    pictures = (root / _PICTURES).iterdir()
    return files | {f"{FOLDER}pictures/{picture.name}": picture.read_bytes() for picture in sorted(pictures)}


def _on_one_page(root: Path, home: str) -> Document:
    """Join all documents to one, so the browser can search them. Each anchor begins with its document's name."""
    documents = [(_name_of(path), _converted(root, path, home, together=True)) for path in PATHS]
    headings = [Heading(2, name, document.title) for name, document in documents]
    html = "\n".join(f'<section id="{name}">\n{document.html}</section>' for name, document in documents)
    about = "Search them with your browser, or print them."
    return Document("All on one page", about, headings, f"<h2>All on one page</h2>\n<p>{about}</p>\n{html}")


def _name_of(path: str) -> str:
    return page_of(path).removesuffix(".html")


def _converted(root: Path, path: str, home: str, together: bool = False) -> Document:
    """Return a document as HTML. together: True for the page with all documents."""
    folder = posixpath.dirname(path)

    def link(target: str) -> str | None:
        """Return the target's address in the site. A file that is not in the site gets its address in the project."""
        outside = _OUTSIDE.match(target)
        if outside:
            if not outside[1].startswith("issues"):
                return "../index.html"
            return f"{home}/{outside[1]}" if home else None
        if target.startswith("https:"):
            return target
        name, mark, anchor = target.partition("#")
        file = posixpath.normpath(posixpath.join(folder, name)) if name else path
        if file in PATHS:
            if together:
                return f"#{_name_of(file)}{_BETWEEN if anchor else ''}{anchor}"
            return (page_of(file) if name else "") + mark + anchor
        if file == _PICTURES or not home:
            return None
        return f"{home}/{'tree' if (root / file).is_dir() else 'blob'}/main/{file}"

    def picture(source: str) -> str:
        return f"pictures/{posixpath.basename(source)}"

    text = (root / path).read_text(encoding="utf-8")
    if together:
        return converted(text, link, picture, deeper=2, name=_name_of(path) + _BETWEEN)
    return converted(text, link, picture)


# Markdown


def anchor(text: str) -> str:
    """Return the anchor that GitHub gives a heading.

    >>> anchor("MicroPython on an ESP32: `esptool`")
    'micropython-on-an-esp32-esptool'
    """
    return re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")


def converted(text: str, link: Link, picture: Callable[[str], str], deeper: int = 1, name: str = "") -> Document:
    """Convert a document in Markdown.

    link(target): returns the address of a link, or None to keep only its words.
    picture(source): returns the address of a picture.
    deeper: is added to the levels of headings, because the site has its own first heading.
    name: prefix of all anchors if several documents share a page.
    """
    markdown = MarkdownIt("commonmark", {"html": True}).enable("table")
    tokens = markdown.parse(text)
    headings, about = [], ""
    for index, token in enumerate(tokens):
        inside = tokens[index + 1] if index + 1 < len(tokens) else token
        if token.type == "heading_open":
            words = _words(inside)
            same_text = sum(heading.text == words for heading in headings)  # GitHub numbers equal headings
            suffix = f"-{same_text}" if same_text else ""
            headings.append(Heading(int(token.tag[1]), name + anchor(words) + suffix, words))
            token.attrSet("id", headings[-1].name)
        elif token.type == "paragraph_open" and not about:
            about = _words(inside)
        elif token.type == "th_open" and not inside.content:
            token.tag = tokens[index + 2].tag = "td"  # an empty cell is not a header
        elif token.type == "html_block":
            token.content = _with_pictures(token.content, picture)
        elif token.type == "inline":
            token.children = _linked(token.children or [], link, picture)
        if token.type.startswith("heading_"):
            token.tag = f"h{int(token.tag[1]) + deeper}"
    title, *following = headings
    html = _scrollable(str(markdown.renderer.render(tokens, markdown.options, {})), title.text)
    return Document(title.text, about, following, html)


def _scrollable(html: str, title: str) -> str:
    """Frame each table, so that it scrolls alone, and let the keyboard reach code. title: of the document."""
    named = "".join(f' {key}="{value}"' for key, value in _SCROLLED.items())
    numbers = itertools.count(1)

    def framed(match: re.Match[str]) -> str:
        return f'<div class="wide"{named} aria-label="{escape(title)}, table {next(numbers)}"><table>'

    html = re.sub("<table>", framed, html).replace("</table>", "</table></div>")
    return html.replace("<pre><code", '<pre tabindex="0"><code')


def _words(inline: Token) -> str:
    return "".join(
        " " if token.type == "softbreak" else token.content
        for token in inline.children or []
        if token.type in ("text", "code_inline", "softbreak")
    )


def _linked(children: list[Token], link: Link, picture: Callable[[str], str]) -> list[Token]:
    """Return the tokens with new addresses. Links for which link() returns None are removed."""
    result: list[Token] = []
    open_links: list[bool] = []
    for token in children:
        if token.type == "link_open":
            address = link(str(token.attrGet("href")))
            open_links.append(address is not None)
            if address is None:
                continue
            token.attrSet("href", address)
            if address.startswith(("https:", "http:")):
                token.attrs |= {"target": "_blank", "rel": "noopener"}
        elif token.type == "link_close" and not open_links.pop():
            continue
        elif token.type == "image":
            token.attrSet("src", picture(str(token.attrGet("src"))))
            token.attrSet("loading", "lazy")
        elif token.type == "html_inline":
            token.content = _with_pictures(token.content, picture)
        result.append(token)
    return result


def _with_pictures(html: str, picture: Callable[[str], str]) -> str:
    return _IMAGE.sub(lambda found: found[1] + picture(found[2]) + found[3], html)
