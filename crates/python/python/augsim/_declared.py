"""Writes the text of a model file from declarations in Python."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ._errors import UsageError

#: Sections of a model file that a caller may add to a model with a function.
MORE_SECTIONS = ("let", "tables", "events", "candidate", "numerics")


def declared(what: str, given: Any) -> dict[str, Any]:
    """Names and their settings, from a list of names or a mapping."""
    if given is None:
        return {}
    if isinstance(given, Mapping):
        names = dict(given)
    elif isinstance(given, str) or not isinstance(given, Iterable):
        raise UsageError(f"{what} = {given!r}: give a list of names, or a dict of names and their settings")
    else:
        names = {name: {} for name in given}
    for name in names:
        if not isinstance(name, str):
            raise UsageError(f"{what}: the name {name!r} is no text; give names such as 'angle_rad'")
    return names


def setting(value: Any, key: str) -> dict[str, Any]:
    """The settings of one name as a table; a plain value is that of ``key``."""
    if value is None:
        return {}
    return dict(value) if isinstance(value, Mapping) else {key: value}


def parameter(name: str, value: Any) -> dict[str, Any]:
    """The settings of a parameter: a number, ``(nominal, min, max)``, or a table."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        if len(value) != 3:
            raise UsageError(f"parameter `{name}` = {value!r}: give a number, (nominal, min, max), or a dict")
        return dict(zip(("nominal", "min", "max"), value))
    table = setting(value, "nominal")
    if "nominal" not in table:
        raise UsageError(f"parameter `{name}`: there is no value; give a number, (nominal, min, max), or a dict with `nominal`")
    return table


def text(sections: Mapping[str, Any]) -> str:
    """The text of a model file: plain values first, then a table for each mapping, and blocks for each list of mappings."""
    lines: list[str] = []
    for key, value in sections.items():
        if not isinstance(value, Mapping) and not _is_blocks(value):
            lines.append(f"{_key(key)} = {_value(key, value)}")
    for key, value in sections.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{_key(key)}]", *(f"{_key(k)} = {_value(f'{key}.{k}', v)}" for k, v in value.items())]
        elif _is_blocks(value):
            for block in value:
                lines += ["", f"[[{_key(key)}]]", *(f"{_key(k)} = {_value(f'{key}.{k}', v)}" for k, v in block.items())]
    return "\n".join(lines) + "\n"


def _is_blocks(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str) and all(isinstance(v, Mapping) for v in value) and len(value) > 0


def _key(key: str) -> str:
    return key if key and all(c.isascii() and (c.isalnum() or c in "_-") for c in key) else json.dumps(key)


def _value(place: str, value: Any) -> str:
    if isinstance(value, bool) or type(value).__name__ == "bool_":
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, Mapping):
        inside = ", ".join(f"{_key(k)} = {_value(f'{place}.{k}', v)}" for k, v in value.items())
        return "{ " + inside + " }" if inside else "{}"
    if hasattr(value, "tolist"):
        return _value(place, value.tolist())
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value).replace("infinity", "inf")
    if isinstance(value, Sequence):
        return "[" + ", ".join(_value(place, v) for v in value) + "]"
    raise UsageError(f"{place} = {value!r}: a value of type {type(value).__name__}; give a number, a text, or a list of them")
