"""The name of kickstand_sim.simulated_board until 0.4, so that programs written for it still work."""

import importlib
import sys
from collections.abc import Mapping
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType


class EarlierNames(MetaPathFinder, Loader):
    """Imports packages and their modules also by earlier names. moved: {earlier name: name of the package}."""

    def __init__(self, moved: Mapping[str, str]) -> None:
        self._moved = moved

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        for earlier, name in self._moved.items():
            if f"{fullname}.".startswith(f"{earlier}."):
                return ModuleSpec(fullname, self, origin=name + fullname.removeprefix(earlier))
        return None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(str(spec.origin))
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        if module.__spec__ is not None:
            module.__spec__ = module.__spec__.loader_state  # the import has replaced it


sys.meta_path.insert(0, EarlierNames({__name__: "kickstand_sim.simulated_board"}))
__path__: list[str] = []  # makes this module a package
