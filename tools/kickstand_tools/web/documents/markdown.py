"""Converts a Markdown document to HTML. Headings get the same anchors as on GitHub. The caller chooses the links."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from html import escape

from markdown_it import MarkdownIt
from markdown_it.token import Token

_IMAGE = re.compile(r'(<img [^>]*?src=")([^"]+)(")')
_SCROLLED = {"tabindex": "0", "role": "region"}  # content wider than a phone can be scrolled, by the keyboard too

Link = Callable[[str], str | None]


@dataclass
class Heading:
    """A heading of a document."""

    level: int  # 1 for the title
    name: str  # its anchor
    text: str  # its text without markup


@dataclass
class Document:
    """A converted document."""

    title: str  # text of the first heading
    about: str  # text of the first paragraph
    headings: list[Heading]  # all headings except the title
    html: str  # the whole document


def anchor(text: str) -> str:
    """Return the anchor that GitHub gives a heading.

    >>> anchor("MicroPython on an ESP32: `esptool`")
    'micropython-on-an-esp32-esptool'
    """
    return re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")


def converted(text: str, link: Link, picture: Callable[[str], str], deeper: int = 1, name: str = "") -> Document:
    """Convert a document in Markdown.

    link(target): returns the address of a link, or None to keep only its words. picture(source): the address of a
    picture.
    deeper: is added to the levels of headings, because the site has its own first heading.
    name: prefix of all anchors if several documents share a page.
    """
    markdown = MarkdownIt("commonmark", {"html": True}).enable("table")
    tokens = markdown.parse(text)
    headings, about, table = [], "", 0
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
    html = str(markdown.renderer.render(tokens, markdown.options, {}))
    named = "".join(f' {key}="{value}"' for key, value in _SCROLLED.items())

    def framed(match: re.Match[str]) -> str:
        nonlocal table
        table += 1
        return f'<div class="wide"{named} aria-label="{escape(title.text)}, table {table}"><table>'

    html = re.sub("<table>", framed, html).replace("</table>", "</table></div>")
    html = html.replace("<pre><code", '<pre tabindex="0"><code')
    return Document(title.text, about, following, html)


def _words(inline: Token) -> str:
    """Return the text of an inline token, without markup."""
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
