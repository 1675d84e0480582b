"""The base class of all sections of a case file: unknown settings are errors, with messages in plain words."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.config import JsonDict
from pydantic_core import PydanticCustomError


class Unknown:
    """The value of a setting that does not exist, with the names that do."""

    def __init__(self, names: list[str]):
        self.names = names


class Section(BaseModel):
    """Settings that belong together."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    @model_validator(mode="before")
    @classmethod
    def _prepare(cls, data: Any) -> Any:
        """Treat an empty list or section as absent; errors about unknown names list the known ones."""
        if not isinstance(data, dict):
            return data
        fields = {field.alias or name: field for name, field in cls.model_fields.items()}
        return {
            name: value if name in fields else Unknown(list(fields))
            for name, value in data.items()
            if not (value is None and name in fields and fields[name].default_factory)
        }


def setting(default: Any = ..., meaning: str = "", *, unit: str = "", name: str | None = None) -> Any:
    """A field of a section: default (... if required; a type for an empty one of it), meaning and unit for the docs.

    `name` is how case files call it, where Python cannot.
    """
    extra: JsonDict | None = {"unit": unit} if unit else None
    if isinstance(default, type):
        return Field(default_factory=default, description=meaning, json_schema_extra=extra, alias=name)
    return Field(default, description=meaning, json_schema_extra=extra, alias=name)


def fault(message: str, *keys: str | int, column: int = 0) -> PydanticCustomError:
    """An error for a validator to raise; `keys` lead from its section or value to the setting that is wrong.

    A message that begins with "must", "needs", "is" or ":" gets the name of the setting in front. `column` counts the
    characters of a text from 1.
    """
    return PydanticCustomError("fault", "{message}", {"message": message, "keys": keys, "column": column})
