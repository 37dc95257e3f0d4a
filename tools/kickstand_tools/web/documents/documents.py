"""Lists the documents and converts them to pages of the site."""

import posixpath
import re
from dataclasses import dataclass
from pathlib import Path

from ...common import firmware_path
from ...common.templates import filled
from .markdown import Document, Heading, converted

FOLDER = "docs/"  # in the site
ALL = "all.html"
_BETWEEN = "--"  # separates a document's name from an anchor, on the page with all documents
_TEMPLATE = Path(__file__).with_name("document.html")
# The documents in reading order: (title of the group, paths in the project)
GROUPS = (
    ("Start", ("README.md",)),
    (
        "On the bike",
        (
            "firmware/README.md",
            "firmware/docs/settings.md",
            "firmware/docs/displays.md",
            "firmware/docs/rides.md",
            "firmware/docs/live.md",
            "firmware/docs/cars.md",
            "firmware/docs/your-own-code.md",
            "firmware/docs/how-it-works.md",
            "firmware/docs/what-it-costs.md",
            "firmware/docs/limits.md",
            "firmware/FAQ.md",
        ),
    ),
    (
        "On the computer",
        (
            "tools/README.md",
            "tools/docs/recordings.md",
            "tools/docs/file-formats.md",
            "tools/docs/tracks-and-videos.md",
            "tools/docs/accuracy.md",
            "tools/docs/pages.md",
            "tools/docs/simulation.md",
            "tools/docs/fleets.md",
            "tools/docs/python.md",
            "tools/docs/security.md",
        ),
    ),
    ("The project", (".github/CONTRIBUTING.md", "CHANGELOG.md")),
)
PATHS = tuple(path for _, paths in GROUPS for path in paths)
_PICTURES = "tools/pictures"
_START = {"README.md": "index", "firmware/README.md": "device", "tools/README.md": "tools"}
# links to the project's own repository on GitHub
_OUTSIDE = re.compile(r"(?:\.\./){2,}(issues/.*|deployments/github-pages)$")


@dataclass
class Entry:
    """A line in the list of documents."""

    title: str
    page: str
    path: str


def page_of(path: str) -> str:
    """Return the name of a document's page in FOLDER.

    >>> page_of("firmware/README.md"), page_of("firmware/docs/live.md"), page_of("firmware/FAQ.md")
    ('device.html', 'live.html', 'faq.html')
    """
    return _START.get(path, posixpath.basename(path).removesuffix(".md").lower()) + ".html"


def document_files(home: str) -> dict[str, bytes]:
    """Build the pages of all documents, one page with all of them together, and their pictures.

    home: the project's address, or "" if it is unknown. Then links to the project's other files and issues are left
        out.
    Returns {path in the site: content}.
    """
    root = firmware_path.documents()
    converted = {path: _converted(root, path, home) for path in PATHS}
    groups = [(title, [Entry(converted[path].title, page_of(path), path) for path in paths]) for title, paths in GROUPS]
    pages = {page_of(path): (document, path) for path, document in converted.items()}
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
    converted = [(_name_of(path), _converted(root, path, home, together=True)) for path in PATHS]
    headings = [Heading(2, name, document.title) for name, document in converted]
    html = "\n".join(f'<section id="{name}">\n{document.html}</section>' for name, document in converted)
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
