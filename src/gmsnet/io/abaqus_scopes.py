"""Where names and numbers of an Abaqus deck hold: parts and the assembly number their nodes and elements anew.

Instances are copies of parts at other places. The parts are in the file, each in its own coordinates, and these are
what is read; what says ``INSTANCE=`` or ``INSTANCE.name`` belongs to the part of that instance.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from gmsnet.io.abaqus_deck import Deck, Section

GENERATED = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "TIENODES", "SUBMODEL", "INSTANCELIBRARY")
ENDS = {"ENDPART": "part", "ENDASSEMBLY": "assembly", "ENDINSTANCE": "instance"}
TOP = ("", "")
Scope = tuple[str, str]  # what opened it, and its name in capitals


@dataclass
class Scopes:
    """Where the reader stands. of_instance: name in capitals → the scope of its nodes."""

    open: list[Scope] = field(default_factory=lambda: [TOP])
    of_instance: dict[str, Scope] = field(default_factory=dict)

    @property
    def here(self) -> Scope:
        """The innermost scope that is open."""
        return self.open[-1]

    def enter(self, deck: Deck, section: Section) -> bool:
        """Whether the section opens or closes a scope. Raises FormatError where it closes one that is not open."""
        key = section.name.lower()
        if key in ("part", "assembly", "instance"):
            name = "" if key == "assembly" else section.get("NAME").upper()  # there is one
            scope = (key, name)
            if key == "instance":
                if section.get("LIBRARY"):
                    deck.text.fail(section.at, "this instance is of another analysis: only what is in the file is read")
                part = section.get("PART").upper()
                self.of_instance[name] = ("part", part) if part else scope
                scope = self.of_instance[name]
            self.open.append(scope)
            return True
        if section.name in ENDS:
            if len(self.open) == 1:
                deck.text.fail(section.at, f"*{section.name} closes what was not opened")
            self.open.pop()
            return True
        return False

    def of(self, section: Section) -> Scope:
        """The scope of the numbers in a section: that of its instance, or the one that is open."""
        return self.named(section.get("INSTANCE"))

    def named(self, instance: str) -> Scope:
        """The scope of an instance's numbers; an empty name is that of the innermost scope."""
        return self.of_instance.get(instance.upper(), self.here) if instance else self.here


def refuse_other_places(deck: Deck, section: Section) -> None:
    """Raises FormatError where nodes or cells stand elsewhere than in the lines of this file."""
    text, at = deck.text, section.at
    if section.name == "INCLUDE" or (section.name in ("NODE", "ELEMENT", "NSET", "ELSET") and section.get("INPUT")):
        told = f"*{section.name} reads another file ({section.get('INPUT')[:24]!r})"
        text.fail(at, f"{told}: put its lines here in its place, or smooth that file if it holds the whole mesh")
    if section.name in GENERATED:
        text.fail(at, f"*{section.name} makes nodes or cells that are not listed: write the file with all of them")
    system = section.get("SYSTEM").upper() if section.name == "NODE" else ""
    if system not in ("", "R"):
        text.fail(at, f"SYSTEM={system[:8]}: only rectangular coordinates are read: write x, y and z")
    if section.name == "SYSTEM" and len(deck.rows(section)):
        text.fail(at, "*SYSTEM: the nodes are in another system of coordinates: write them in that of the model")
