"""`treepipe validate`: the faults of a CityJSON or LsJSON file."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli import options
from pipeline.errors import InputFormatError, InputMissingError, UsageError

if TYPE_CHECKING:
    from pipeline.cityjson import Finding


@click.command("validate")
@click.argument("file", type=options.FILE)
@click.option(
    "--schema",
    type=options.FILE,
    metavar="F",
    help="The official cityjson.min.schema.json (cityjsonfeature.min.schema.json), to check against too.",
)
@options.as_json
@options.messages
@click.pass_context
def command(context: click.Context, /, file: Path, schema: Path | None, as_json: bool) -> None:
    """Check FILE (.city.json, .city.jsonl, .ls.json); the exit code is 1 where it has faults."""
    findings = _findings(file, schema)
    errors = [{"where": each.where, "what": each.what, "remedy": each.remedy} for each in findings]
    if as_json:
        click.echo(json.dumps({"valid": not errors, "errors": errors}, indent=2, ensure_ascii=False))
    elif findings:
        for each in findings:
            click.echo(f"{file}: {each}")
    else:
        click.echo(f"{file}: valid")
    context.exit(1 if errors else 0)


def _findings(file: Path, schema: Path | None) -> list[Finding]:
    from pipeline.cityjson import check, check_seq, read_cityjson

    name = file.name.lower()
    if not name.endswith((".city.json", ".city.jsonl", *options.LSYSTEM_SUFFIXES)):
        msg = f"{file}: cannot be validated; give a .city.json, .city.jsonl, .ls.json or .ls.json.zst file"
        raise UsageError(msg)
    if schema is not None and name.endswith(options.LSYSTEM_SUFFIXES):
        msg = f"--schema {schema}: is for CityJSON, and {file} is an L-system; leave it out"
        raise UsageError(msg)
    if not file.is_file():
        msg = f"{file}: there is no such file; check the name"
        raise InputMissingError(msg)
    rules = _schema(schema) if schema else None
    try:
        if name.endswith(".city.json"):
            return check(read_cityjson(file), schema=rules)
        if name.endswith(".city.jsonl"):
            return list(check_seq(file, schema=rules))
        from pipeline.lsystem import decode, read_lsjson

        options.warn_if_flat(file, decode(read_lsjson(file)))
    except InputFormatError as error:
        what, _, remedy = str(error).removeprefix(f"{file}: ").partition("; ")
        place = re.search(r"at character (\d+)", what)
        where = f"L-string, character {place[1]}" if place else "file"
        return [_finding(where, what, remedy)]
    return []


def _finding(where: str, what: str, remedy: str) -> Finding:
    from pipeline.cityjson import Finding

    return Finding(where, _full(what), _full(remedy or "write the file anew"))


def _full(text: str) -> str:
    """Return a text with a capital at its start and a full stop; names inside keep theirs."""
    return f"{text[:1].upper()}{text[1:]}."


def _schema(file: Path) -> dict[str, Any]:
    try:
        rules = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        msg = f"{file}: the schema cannot be read ({error.strerror}); check the name given to --schema"
        raise InputMissingError(msg) from error
    except ValueError as error:
        msg = f"{file}: is no JSON schema ({error}); give cityjson.min.schema.json"
        raise InputFormatError(msg) from error
    if not isinstance(rules, dict):
        msg = f"{file}: is no JSON schema; give cityjson.min.schema.json"
        raise InputFormatError(msg)
    return rules
