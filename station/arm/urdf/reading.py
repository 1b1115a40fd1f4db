"""Files of strangers: bounded in size; XML without a document type, so without entities that grow or name files."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from shared.errors import UserError


def read_bounded(path: Path, *, most_bytes: int, what: str) -> bytes:
    """Reads the bytes of a regular file.

    Raises:
        UserError: if it is missing, no regular file, unreadable, or larger than `most_bytes`.
    """
    try:
        if not path.is_file():
            raise UserError(f"Expected {what} at {path}, but there is no such file")
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
    except (OSError, ValueError) as error:
        raise UserError(f"Expected to read {what} at {path}, but that failed: {error}") from error
    if len(data) > most_bytes:
        raise UserError(f"Expected {what} of at most {most_bytes / 1e6:g} MB, but {path} is larger; simplify it")
    return data


def read_xml(data: bytes, *, what: str) -> Element:
    """Reads the root of an XML document.

    Prefixes stay as they are written, because robots' files often leave them unbound.

    Raises:
        UserError: if it is not XML, or has a document type, which alone can declare entities.
    """

    def refuse(*_: object) -> None:
        raise UserError(f"Expected no <!DOCTYPE> in {what}: it can make a small file grow without end; remove it")

    builder = TreeBuilder()
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartDoctypeDeclHandler = refuse
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError) as error:  # an encoding that there is not is a LookupError
        raise UserError(f"Expected XML in {what}, but it cannot be read: {error}") from error
    return builder.close()
