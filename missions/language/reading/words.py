"""Words of a file with their roles, recorded by the readers, also in files with errors.

Hover, completion, go-to-definition, rename and the outline of the language server use them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum, auto

from behaviours.catalogue import Catalogue
from missions.language.expressions.scope import Scope
from missions.language.keys import Form, Keys
from missions.language.step import Tree
from stack.documents import Node
from stack.parameters import Declaration


class WordRole(StrEnum):
    """What a word of a file is."""

    SECTION_KEY = auto()
    """A key of the section that `owner` names."""
    KIND = auto()
    MODIFIER = auto()
    PORT = auto()
    INPUT = auto()
    OUTPUT = auto()
    VALUE = auto()
    EXPRESSION = auto()
    TARGET = auto()
    KEY = auto()
    """A blackboard key or `out` that `set` writes."""
    TREE = auto()
    TYPE = auto()
    DECLARED = auto()
    """A name in the section that `owner` names."""
    PLACE = auto()
    WORLD = auto()
    ROBOT = auto()
    FILE = auto()
    COMPONENT_KIND = auto()
    COMPONENT = auto()
    PARAMETER = auto()
    FAULT = auto()
    """A kind of fault."""
    NODE_NAME = auto()
    """A node, behaviour, tree or event in a test."""
    CHANGE = auto()
    """A robot value, `$key` or `event` that a test changes."""
    EXPECTATION = auto()
    """A key of `expect`: of its section, or a blackboard key."""
    ARGUMENT = auto()
    WORD = auto()
    """One of the words in `options`."""


@dataclass(frozen=True, slots=True)
class Word:
    """One key or value of a file.

    Attributes:
        scope: the names that are visible; None: those of the file.
        owner: the behaviour, tree, component, modifier or section that it belongs to.
        declared: declaration of the port, output or value.
        options: the allowed words.
    """

    node: Node
    role: WordRole
    scope: Scope | None = None
    owner: str = ""
    declared: Declaration | None = None
    options: tuple[str, ...] = ()


@dataclass
class Words:
    """The words that a reader has met, in this file and in the files that it includes.

    Attributes:
        items: in the order of reading.
        scope: the names of the mission, or of the file of trees.
        trees: by name, with those of included files.
        catalogue: the behaviours; None before it is known.
        names: everything that a test can name.
        document: of the file; None if it is not valid YAML.
    """

    items: list[Word] = field(default_factory=list)
    scope: Scope = field(default_factory=lambda: Scope(()))
    trees: dict[str, Tree] = field(default_factory=dict)
    catalogue: Catalogue | None = None
    names: tuple[str, ...] = ()
    document: Node | None = None

    def add(
        self, node: Node, role: WordRole, scope: Scope | None = None, owner: str = "",
        declared: Declaration | None = None,
    ) -> None:  # fmt: skip
        """Record a word."""
        options = declared.one_of if declared else ()
        self.items.append(Word(node, role, scope, owner, declared, tuple(options)))

    def choice(self, node: Node, options: Iterable[str], role: WordRole = WordRole.WORD) -> None:
        """Record a word that is one of the options."""
        self.items.append(Word(node, role, options=tuple(options)))

    def keys(self, node: Node | None, section: str, scope: Scope | None = None) -> None:
        """Record the keys of a section; a value that is not a mapping may become one."""
        if node is None:
            return
        if not node.is_mapping:
            self.add(node, WordRole.SECTION_KEY, scope, section)
        for key, _ in node.entries:
            self.add(key, WordRole.SECTION_KEY, scope, section)

    def top(self, top: Node, section: str, keys: Keys) -> None:
        """Record the top-level keys of a file, and the files that they name."""
        self.document = self.document or top
        self.keys(top, section)
        for key, value in top.entries:
            word = str(key.value)
            known = keys.get(word)
            if known is None:
                continue
            role = _TOP.get(known.form)
            if role is not None:
                self.items.append(Word(value, role, owner=word, options=known.words))
            elif known.form is Form.FILES:
                for item in value.items:
                    self.add(item, WordRole.FILE, owner=word)

    def of_file(self, file: str) -> Iterator[Word]:
        """Yield the words of one file."""
        return (word for word in self.items if word.node.mark.file == file)


@dataclass(frozen=True)
class Draft:
    """A text in an editor, read instead of a file's; None reads the file.

    Attributes:
        words: receives the words with their roles, also if there are errors.
    """

    text: str | None = None
    words: Words = field(default_factory=Words)


_TOP = {
    Form.PLACE: WordRole.PLACE,
    Form.WORLD: WordRole.WORLD,
    Form.ROBOT: WordRole.ROBOT,
    Form.FILE: WordRole.FILE,
}
