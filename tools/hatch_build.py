"""project.urls of what is built on GitHub, which knows where the project is at home: a copy elsewhere names its own."""

import os

from hatchling.metadata.plugin.interface import MetadataHookInterface


class Urls(MetadataHookInterface):
    """Called when a wheel is built or the project is installed."""

    def update(self, metadata: dict) -> None:
        """Add the addresses, none of a build that GitHub does not do."""
        server, repository = os.environ.get("GITHUB_SERVER_URL"), os.environ.get("GITHUB_REPOSITORY")
        home = f"{server}/{repository}" if server and repository else ""
        pages = {"Homepage": "", "Source": "", "Issues": "/issues", "Changelog": "/blob/main/CHANGELOG.md"}
        metadata["urls"] = {name: home + page for name, page in pages.items() if home}
