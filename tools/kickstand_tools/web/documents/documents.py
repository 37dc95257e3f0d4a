"""Which documents there are, and the pages made of them."""

import posixpath
import re
from dataclasses import dataclass
from pathlib import Path

from ...common import firmware_path
from ...common.templates import filled
from .markdown import Document, converted

FOLDER = "docs/"  # in the site
_TEMPLATE = Path(__file__).with_name("document.html")
# In the order in which one reads them: (title of the group, paths in the project)
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
_OUTSIDE = re.compile(r"(?:\.\./){2,}(issues/.*|deployments/github-pages)$")  # of the project's own place on GitHub


@dataclass
class Entry:
    """A line in the list of documents."""

    title: str
    page: str
    path: str


def page_of(path: str) -> str:
    """The name of a document's page in FOLDER.

    >>> page_of("firmware/README.md"), page_of("firmware/docs/live.md"), page_of("firmware/FAQ.md")
    ('device.html', 'live.html', 'faq.html')
    """
    return _START.get(path, posixpath.basename(path).removesuffix(".md").lower()) + ".html"


def document_files(home: str) -> dict[str, bytes]:
    """{path in the site: content} of all documents and their pictures. home: the address of the project, "" if it is
    unknown: then links to its other files and to its issues are left out."""
    root = firmware_path.documents()
    made = {path: _converted(root, path, home) for path in PATHS}
    groups = [(title, [Entry(made[path].title, page_of(path), path) for path in paths]) for title, paths in GROUPS]
    files = {
        f"{FOLDER}{page_of(path)}": filled(
            _TEMPLATE, document=document, path=path, groups=groups, home=home, start=page_of(PATHS[0])
        ).encode()
        for path, document in made.items()
    }
    pictures = (root / _PICTURES).iterdir()
    return files | {f"{FOLDER}pictures/{picture.name}": picture.read_bytes() for picture in sorted(pictures)}


def _converted(root: Path, path: str, home: str) -> Document:
    here = posixpath.dirname(path)

    def link(target: str) -> str | None:
        """In the site, else at the project's home."""
        outside = _OUTSIDE.match(target)
        if outside:
            if not outside[1].startswith("issues"):
                return "../index.html"
            return f"{home}/{outside[1]}" if home else None
        if target.startswith(("https:", "#")):
            return target
        name, mark, anchor = target.partition("#")
        file = posixpath.normpath(posixpath.join(here, name))
        if file in PATHS:
            return page_of(file) + mark + anchor
        if file == _PICTURES or not home:
            return None
        return f"{home}/{'tree' if (root / file).is_dir() else 'blob'}/main/{file}"

    def picture(source: str) -> str:
        return f"pictures/{posixpath.basename(source)}"

    return converted((root / path).read_text(encoding="utf-8"), link, picture)
