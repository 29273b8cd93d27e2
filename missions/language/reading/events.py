"""Reader of `events`, which pre-empt `run`."""

from __future__ import annotations

from missions.language.expressions.expression import NameContext
from missions.language.foreign_words import EVENT_WORDS, THEN_MEANINGS, meant_or_near
from missions.language.keys import AGAIN, EVENT, HOLD, THEN_WORDS, required
from missions.language.reading.literals import IDENTIFIER
from missions.language.reading.nodes import NodeReader
from missions.language.reading.words import WordRole
from missions.language.step import Event
from missions.language.values import Constant, Value
from stack.documents import Node

NO_HOLD = Constant(0.0)


class EventReader:
    """Reads the section `events` of a mission."""

    def __init__(self, nodes: NodeReader) -> None:
        self.nodes, self.values, self.findings = nodes, nodes.values, nodes.findings

    def events(self, node: Node | None, context: NameContext) -> tuple[Event, ...]:
        """Return the events in order; report and skip invalid ones."""
        if node is None or (node.kind == "scalar" and node.value is None):
            return ()
        if not node.is_sequence:
            hint = "write `- name:` for each event, the most important one first"
            self.findings.add("E112", node.mark, f"events must be a list, got {node.words()}", hint)
            return ()
        found: dict[str, Event | None] = {}
        for item in node.items:
            named = self._named(item)
            if named is None:
                continue
            key, body = named
            name = str(key.value)
            self.values.words.add(key, WordRole.DECLARED, owner="events")
            if name in found:
                self.findings.add(
                    "E112", key.mark, f"there are two events {name!r}; rename one of them"
                )
                continue
            found[name] = self._event(key, body, context)
        return tuple(event for event in found.values() if event is not None)

    def _named(self, item: Node) -> tuple[Node, Node] | None:
        """Return name and body of `- lost: {when: …}`."""
        entries = item.entries
        if len(entries) == 1 and entries[0][1].is_mapping:
            if IDENTIFIER.fullmatch(str(entries[0][0].value)):
                return entries[0]
            sentence = f"{entries[0][0].words()} is not a valid name"
            hint = "use letters, digits and _; start with a letter"
            self.findings.add("E144", entries[0][0].mark, sentence, hint)
            return None
        for _, body in entries:
            self.values.words.keys(body, "event")
        hint = "indent the keys of an event below its name" if len(entries) > 1 else ""
        sentence = f"an event is {{name: {{when: …, do: …}}}}, got {item.words()}"
        self.findings.add("E112", item.mark, sentence, hint)
        return None

    def _event(self, key: Node, body: Node, context: NameContext) -> Event | None:
        name = str(key.value)
        self.values.words.keys(body, "event", context.scope)
        for word, _ in body.entries:
            if word.value not in EVENT:
                hint = meant_or_near(str(word.value), EVENT_WORDS, EVENT)
                sentence = f"an event has no key {word.value!r}"
                self.findings.add("E112", word.mark, sentence, hint)
        when, do, held = body.get("when"), body.get("do"), body.get("hold")
        for needed in required(EVENT):
            meant = {EVENT_WORDS.get(str(word.value)) for word, _ in body.entries}
            if body.get(needed) is None and needed not in meant:
                self.findings.add(
                    "E112", key.mark, f"the event {name!r} needs `{needed}`", f"add `{needed}: …`"
                )
        condition = self.values.expression(when, context) if when else None
        hold: Value | None = self.values.value(HOLD, held, context) if held else NO_HOLD
        given = body.get("again")
        again = self.values.value(AGAIN, given, context) if given else None
        step = self.nodes.read(do, context) if do else None
        then = self._then(body.get("then"))
        if condition is None or hold is None or step is None or (given and again is None):
            return None
        return Event(name, key.mark, condition, hold, step, then, again)

    def _then(self, node: Node | None) -> str:
        if node is None:
            return THEN_WORDS[0]
        self.values.words.choice(node, THEN_WORDS)
        if node.value not in THEN_WORDS:
            hint = meant_or_near(str(node.value), THEN_MEANINGS, THEN_WORDS)
            sentence = f"then must be one of {', '.join(THEN_WORDS)}, got {node.words()}"
            self.findings.add("E112", node.mark, sentence, hint)
            return THEN_WORDS[0]
        return str(node.value)
