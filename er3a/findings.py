"""What computation finds: codes with typed parameters, from which sentences are made elsewhere.

A finding is a frozen dataclass whose last field is ``code: Literal["some_code"] = "some_code"``; its other fields are
the parameters, plain or findings themselves, with the unit in the name. Several kinds of finding in one place are a
union. Nothing decides by a sentence: code asks for the type or the code.
"""

from __future__ import annotations

from typing import Any, ClassVar, Protocol


class Finding(Protocol):
    """Any finding."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def code(self) -> str:
        """What was found: the stable identifier that summaries hold."""
        ...
