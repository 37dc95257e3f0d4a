"""Adds to pyproject.toml during a build: the addresses of the project on GitHub, and the commands of a checkout."""

import os

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface


class Urls(MetadataHookInterface):
    """Sets project.urls in a build on GitHub, where the repository is known. Other builds have no URLs."""

    def update(self, metadata: dict) -> None:
        """Add the addresses to the metadata."""
        server, repository = os.environ.get("GITHUB_SERVER_URL"), os.environ.get("GITHUB_REPOSITORY")
        home = f"{server}/{repository}" if server and repository else ""
        pages = {"Homepage": "", "Source": "", "Issues": "/issues", "Changelog": "/blob/main/CHANGELOG.md"}
        metadata["urls"] = {name: home + page for name, page in pages.items() if home}


class Workshop(BuildHookInterface):
    """Adds the workshop's commands to an editable installation. pyproject.toml lists them in the hook's settings."""

    def initialize(self, version: str, build_data: dict) -> None:
        """Add the entry points. A wheel gets none of them, because it does not contain their modules."""
        if version == "editable":
            for group, commands in self.config["entry-points"].items():
                self.metadata.core.entry_points.setdefault(group, {}).update(commands)
