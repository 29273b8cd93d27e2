"""Every name in the style sheet is that of a widget, an id or a class that the dashboard has."""

import re
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import textual.screen
import textual.widgets
from textual.dom import DOMNode

import tui

SHEET = Path(tui.__file__).with_name("app.tcss").read_text("utf-8")
SOURCES = "".join(file.read_text("utf-8") for file in Path(tui.__file__).parent.rglob("*.py"))


def selectors():
    """Selectors without variables and declarations."""
    text = re.sub(r"/\*.*?\*/|\$[\w-]+:[^;]*;", "", SHEET, flags=re.DOTALL)
    return re.findall(r"([^{}]+)\{[^}]*\}", text)


def widgets():
    for module in walk_packages(tui.__path__, "tui."):
        if not module.name.endswith("__main__"):
            import_module(module.name)

    def below(cls):
        for inner in cls.__subclasses__():
            yield inner.__name__
            yield from below(inner)

    return {*below(DOMNode), *textual.widgets.__all__}


def test_every_widget_of_the_style_sheet_exists():
    named = {word for one in selectors() for word in re.findall(r"(?<![\w.#-])[A-Z]\w+", one)}
    assert named
    assert named - widgets() == set()


def test_every_id_and_class_of_the_style_sheet_is_used():
    for kind in ("#", r"\."):
        for name in {word for one in selectors() for word in re.findall(rf"{kind}([\w-]+)", one)}:
            stem = name.removeprefix("-").removeprefix("full-")
            assert stem in SOURCES or stem.startswith(("footer-key", "option-list")), name
