"""Text from a device: names, versions, serial numbers."""

from __future__ import annotations

REPLACEMENT = "\N{REPLACEMENT CHARACTER}"


def printable_text(data: bytes, encoding: str = "ascii") -> str:
    """Return the text in bytes that are padded with zeros, without anything that steers a terminal.

    What a device calls itself goes to terminals, logs and /diagnostics: whatever is not printable
    (control characters, escapes, line ends, marks of writing direction) is replaced.
    """
    text = data.split(b"\0", 1)[0].decode(encoding, errors="replace")
    return "".join(character if character.isprintable() else REPLACEMENT for character in text)
