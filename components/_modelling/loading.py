"""Code of one's own: modules from files and folders, and every mistake in them as one line.

    folder = folder_of(Path("machine"))
    module = folder.load(Path("machine/spring.py"))        # `import magnet` finds machine/magnet.py meanwhile
    spring = guarded(module.spring, folder, "spring() to return a Model")

A folder is importable while its modules are loaded and while their functions run; then `sys.path` and `sys.modules` are
what they were. So two folders may have modules of one name. A folder with `__init__.py` is a package, whose modules may
import each other relatively or by the package's name. A module is loaded again when a file it came with has changed.

An exception becomes an error with file, line and what is expected there; the exception is its cause.
"""

import ast
import contextlib
import functools
import importlib
import importlib.util
import inspect
import os
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, ParamSpec, TypeVar

from hfsa.components._modelling.errors import ModelError

P = ParamSpec("P")
R = TypeVar("R")

_LOCK = threading.RLock()

_OWN = "own_"
"""Before the name of a module that is called as one of the standard library."""


class Installed:
    """The place of code that Python's own import finds, in a package's folder."""

    def __init__(self, root: Path):
        self.root = root

    def within(self) -> contextlib.AbstractContextManager[None]:
        """Return a context in which its modules can be imported, which they can anyway."""
        return contextlib.nullcontext()


class Folder:
    """The place of code in a folder that Python does not know."""

    def __init__(self, folder: Path):
        self.root = folder
        self.parts: dict[Any, Any] = {}
        """What has been made of its modules, until a file changes."""
        top, names = folder, []
        while (top / "__init__.py").is_file():
            names.insert(0, top.name)
            top = top.parent
        self._package = ".".join(names)
        self._paths = [folder, top] if names else [folder]
        self._modules: dict[str, ModuleType] = {}
        self._stamps: dict[Path, tuple[int, int]] = {}
        self._is_open = False

    def load(self, file: Path) -> ModuleType:
        """Return the module of a file in this folder."""
        with self.within():
            if self._package:
                return importlib.import_module(f"{self._package}.{file.stem}")
            name = f"{_OWN}{file.stem}" if file.stem in sys.stdlib_module_names else file.stem
            if name in sys.modules:
                return sys.modules[name]
            specification = importlib.util.spec_from_file_location(name, file)
            assert specification is not None
            assert specification.loader is not None
            module = sys.modules[name] = importlib.util.module_from_spec(specification)
            try:
                specification.loader.exec_module(module)
            except BaseException:
                del sys.modules[name]
                raise
            return module

    def refresh(self) -> None:
        """Forget the modules if one of their files has changed."""
        if any(_stamp(file) != stamp for file, stamp in self._stamps.items()):
            self._modules, self._stamps, self.parts = {}, {}, {}

    @contextlib.contextmanager
    def within(self) -> Iterator[None]:
        """Make the folder's modules importable in this context alone."""
        with _LOCK:
            if self._is_open:
                yield
                return
            before, path, writes = dict(sys.modules), list(sys.path), sys.dont_write_bytecode
            names = self._names()
            for name, module in before.items():
                if name.partition(".")[0] in names and not self._owns(name, module):
                    del sys.modules[name]  # one of the same name, of elsewhere
            sys.modules.update(self._modules)
            sys.path[:0] = map(str, self._paths)
            # a file that changes twice in a second would leave bytecode that is out of date
            sys.dont_write_bytecode, self._is_open = True, True
            importlib.invalidate_caches()
            try:
                yield
            finally:
                self._keep(before)
                sys.path[:], sys.dont_write_bytecode, self._is_open = path, writes, False
                importlib.invalidate_caches()

    def _keep(self, before: dict[str, ModuleType]) -> None:
        """Take the folder's new modules out of `sys.modules`, and put back what they stood for."""
        for name, module in list(sys.modules.items()):
            if before.get(name) is not module and self._owns(name, module):
                self._modules[name] = sys.modules.pop(name)
                if file := getattr(module, "__file__", None):
                    self._stamps[Path(file)] = _stamp(Path(file))
        sys.modules.update({name: module for name, module in before.items() if name not in sys.modules})

    def _names(self) -> set[str]:
        """Return the names that an import finds in the folder first; the standard library has its own."""
        files = {file.stem for file in self.root.glob("*.py")}
        packages = {file.parent.name for file in self.root.glob("*/__init__.py")}
        return (files | packages | {self._package.partition(".")[0]}) - sys.stdlib_module_names

    def _owns(self, name: str, module: ModuleType) -> bool:
        """Whether a module was found in this folder."""
        if name in self._modules:
            return self._modules[name] is module
        found = [getattr(module, "__file__", None), *getattr(module, "__path__", ())]
        top = name.partition(".")[0]
        tops = {top, top.removeprefix(_OWN)}
        places = [(path / name, path / f"{name}.py") for path in self._paths for name in tops]
        files = [Path(file) for file in found if isinstance(file, str)]
        return any(tree in file.parents or file in (tree, single) for file in files for tree, single in places)


@functools.cache
def folder_of(folder: Path) -> Folder:
    """Return the place of a folder (resolved), one for all its files."""
    return Folder(folder)


def is_path(name: str) -> bool:
    """Whether the name of a part or scene is the path of a file or folder."""
    return name.endswith((".py", ".toml")) or "/" in name or os.sep in name or name in (".", "..")


def kind_of(file: Path) -> Literal["part", "scene"] | None:
    """Return what a file of one's own defines, by its text alone; `None` for a module that only helps others.

    A file that is no Python counts as a part.
    """
    try:
        body = ast.parse(file.read_bytes()).body
    except (OSError, SyntaxError, ValueError):
        return "part"
    for node in body:
        if isinstance(node, ast.FunctionDef) and node.name == file.stem:
            words = [n.id for n in ast.walk(node.returns or node) if isinstance(n, ast.Name)]
            words += [n.attr for n in ast.walk(node.returns or node) if isinstance(n, ast.Attribute)]
            words += [str(n.value) for n in ast.walk(node.returns or node) if isinstance(n, ast.Constant)]
            return "scene" if "Scene" in words else "part"
    return "part" if any({file.stem, "analyze"} & _defined(node) for node in body) else None


def _defined(node: ast.stmt) -> set[str]:
    """Return the names that a statement defines."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return {node.name}
    if isinstance(node, ast.Assign):
        return {target.id for target in node.targets if isinstance(target, ast.Name)}
    if isinstance(node, ast.ImportFrom):
        return {alias.asname or alias.name for alias in node.names}
    return set()


def files_of(folder: Path, kind: Literal["part", "scene"]) -> list[Path]:
    """Return the Python files in a folder that define a part or a scene, in alphabetical order."""
    found = [file for file in sorted(folder.glob("*.py")) if not file.name.startswith(("_", ".", "test_"))]
    return [file for file in found if file.name not in ("conftest.py", "setup.py") and kind_of(file) == kind]


def guarded(
    function: Callable[P, R], place: Folder | Installed, expected: str, error: type[ValueError] = ModelError
) -> Callable[P, R]:
    """Return a function whose exceptions are errors of ours, and which runs where its modules can be imported."""

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        with refusing(place, expected, error, location(function)), place.within():
            return function(*args, **kwargs)

    return call


def returned(function: Callable[..., Any], kind: type[R], value: Any, error: type[ValueError] = ModelError) -> R:
    """Return what a function has returned; an error with its file and line where that is of another kind."""
    if not isinstance(value, kind):
        name, found = function.__name__, in_words(value)
        raise error(f"{location(function)}: {name}() returned {found}, expected a {kind.__name__}")
    return value


def in_words(value: Any) -> str:
    """Return the kind of a value in words."""
    name = type(value).__name__
    return "None" if value is None else f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


@contextlib.contextmanager
def refusing(
    place: Folder | Installed, expected: str, error: type[ValueError] = ModelError, otherwise: str = ""
) -> Iterator[None]:
    """Raise an error of ours for any exception of code that lies in a place: file, line, and what is expected.

    `otherwise` is file and line of an exception that did not pass through that code.
    """
    try:
        yield
    except (Exception, SystemExit) as found:
        if getattr(found, "is_located", False):
            raise
        code: int | None = getattr(found, "exit_code", None)
        words = str(found) if code is not None else f"{_words(found)}; expected {expected}"
        where = _where(found, place.root) or otherwise
        is_plain = code is not None and type(found).__init__ in (ValueError.__init__, RuntimeError.__init__)
        refusal = (type(found) if is_plain else error)(f"{where}: {words}" if where else words)
        refusal.is_located = True  # type: ignore[attr-defined]
        if code is not None:
            refusal.exit_code = code  # type: ignore[attr-defined]
        raise refusal from found


def _words(found: BaseException) -> str:
    """Return an exception in words."""
    text = found.msg if isinstance(found, SyntaxError) else str(found)
    return f"{type(found).__name__}: {text}" if text else type(found).__name__


def _where(found: BaseException, root: Path) -> str:
    """Return file and line of the innermost code in a folder that an exception passed through."""
    if isinstance(found, SyntaxError) and found.filename:
        return f"{shown(Path(found.filename))}:{found.lineno or 1}"
    where, step = "", found.__traceback__
    while step is not None:
        file = Path(step.tb_frame.f_code.co_filename)
        if root in file.parents:
            where = f"{shown(file)}:{step.tb_lineno}"
        step = step.tb_next
    return where


def location(function: Callable[..., Any]) -> str:
    """Return file and line of a function."""
    code = inspect.unwrap(function).__code__
    return f"{shown(Path(code.co_filename))}:{code.co_firstlineno}"


def shown(file: Path) -> str:
    """Return a path as a user would type it: from the working folder where it lies in that."""
    with contextlib.suppress(ValueError, OSError):
        return str(file.relative_to(Path.cwd()))
    return str(file)


def _stamp(file: Path) -> tuple[int, int]:
    """Return what changes with a file's content; zeros for a file that has gone."""
    try:
        status = file.stat()
    except OSError:
        return 0, 0
    return status.st_mtime_ns, status.st_size
