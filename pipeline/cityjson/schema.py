"""The official JSON schema, applied fast enough for a tree of a hundred thousand surfaces.

The schema offers 34 types of city object and 8 of geometry as alternatives, and describes every
index of every ring. A plain validator tries all of the former and walks all of the latter: minutes.
Two keywords are therefore read with foresight, to the same verdict. ``oneOf`` goes straight to the
alternative with the instance's ``type``, which also makes the message name the fault itself; and
``items`` looks at plain nested lists of numbers level by level.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import chain
from typing import Any

from jsonschema import ValidationError
from jsonschema.validators import extend, validator_for

from pipeline.cityjson.finding import Finding

LONGEST_SHOWN = 160


def schema_findings(document: Mapping[str, Any], schema: Mapping[str, Any]) -> Iterator[Finding]:
    """Find where a document departs from a JSON schema.

    Parameters
    ----------
    document : mapping
    schema : mapping
        Self-contained, such as ``cityjson.min.schema.json``.

    Yields
    ------
    Finding
    """
    for error in _foresighted(validator_for(schema))(schema).iter_errors(document):
        said = error.message
        if len(said) > LONGEST_SHOWN:
            said = f"the value does not satisfy {error.validator!r}: {said[: LONGEST_SHOWN // 2]} ..."
        yield Finding(
            ", ".join(str(part) for part in error.absolute_path) or "document",
            f"Against the schema, {said}.",
            _remedy(error),
        )


@cache
def _foresighted(plain: Any) -> Any:
    return extend(plain, {"oneOf": _one_of(plain), "items": _items(plain)})


def _remedy(error: Any) -> str:
    if error.validator in ("enum", "const", "required", "type", "pattern"):
        wanted = str(error.validator_value)
        if len(wanted) <= LONGEST_SHOWN:
            return f"The schema wants {error.validator} {wanted}."
    return f"Mend it as the rule {error.validator!r} of the CityJSON schema says."


def _one_of(plain: Any) -> Any:
    usual = plain.VALIDATORS["oneOf"]

    def one_of(validator: Any, alternatives: Any, instance: Any, schema: Any) -> Iterator[Any]:
        kind = instance.get("type") if isinstance(instance, Mapping) else None
        if not isinstance(kind, str) or not all(_names_type(a) for a in alternatives):
            yield from usual(validator, alternatives, instance, schema)
            return
        fitting = [k for k, a in enumerate(alternatives) if _takes(a, kind)]
        if not fitting:
            yield ValidationError(
                f"{kind!r} is not one of the types that are allowed here", validator="oneOf"
            )
        for k in fitting[:1]:
            yield from validator.descend(instance, alternatives[k], schema_path=k)

    return one_of


def _items(plain: Any) -> Any:
    usual = plain.VALIDATORS["items"]

    def items(validator: Any, inner: Any, instance: Any, schema: Any) -> Iterator[Any]:
        if not (isinstance(instance, list) and _fits(inner, instance)):
            yield from usual(validator, inner, instance, schema)

    return items


def _type_rules(alternative: Any) -> Iterator[Mapping[str, Any]]:
    """Yield what an alternative says of the member ``type``, in its own place or under ``allOf``."""
    rule = alternative.get("properties", {}).get("type")
    if isinstance(rule, Mapping):
        yield rule
    for part in alternative.get("allOf", ()):
        yield from _type_rules(part)


def _names_type(alternative: Any) -> bool:
    return isinstance(alternative, Mapping) and any(_type_rules(alternative))


def _takes(alternative: Any, kind: str) -> bool:
    """Tell whether every rule of an alternative on ``type`` takes `kind`."""
    return all(
        ("const" not in rule or rule["const"] == kind)
        and ("enum" not in rule or kind in rule["enum"])
        and ("pattern" not in rule or re.search(rule["pattern"], kind) is not None)
        for rule in _type_rules(alternative)
    )


def _fits(rule: Any, instances: list[Any]) -> bool:
    """Tell whether all instances are numbers, or lists of lists of them, as the rule says.

    False where the rule says anything that is not understood here: then the usual way decides.
    """
    leaves: dict[Any, set[type]] = {"integer": {int}, "number": {int, float}}
    while isinstance(rule, Mapping):
        kinds = rule.get("type")
        kinds = set(kinds) if isinstance(kinds, list) else {kinds}
        if "null" in kinds:
            instances = [v for v in instances if v is not None]
            kinds.discard("null")
        if len(kinds) != 1 or not set(rule) <= {"type", "items", "minItems", "maxItems", "description"}:
            return False
        kind = kinds.pop()
        if kind in leaves:
            return "items" not in rule and {type(v) for v in instances} <= leaves[kind]
        if kind != "array" or not all(type(v) is list for v in instances):
            return False
        low, high = rule.get("minItems", 0), rule.get("maxItems", float("inf"))
        if not all(low <= len(v) <= high for v in instances):
            return False
        rule, instances = rule.get("items"), list(chain.from_iterable(instances))
    return False
