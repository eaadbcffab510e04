"""`treepipe compare`: how far a model is from another, from the truth, or from its points."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from pipeline.cli import options
from pipeline.errors import PipelineError, UsageError

if TYPE_CHECKING:
    from pipeline.accuracy import Comparison

log = logging.getLogger("treepipe")


@click.command("compare")
@click.argument("a", type=options.FILE)
@click.argument("b", type=options.FILE, required=False)
@click.option("--cloud", type=options.FILE, metavar="CLOUD", help="Points to compare A with, instead of B.")
@click.option("--truth", type=options.FILE, metavar="NPZ", help="Known truth to compare A with.")
@click.option(
    "--align",
    type=click.Choice(["root", "none"]),
    help="root: first move A so that its root is that of B. Default: none.",
)
@click.option("--html", type=options.FILE, metavar="F", help="Write a page with the coloured tree and plots.")
@options.overwrite
@options.as_json
@options.messages
def command(
    a: Path, b: Path | None, html: Path | None, overwrite: bool, as_json: bool, **against: object
) -> None:
    """Compare the model or skeleton A with the reference B, or with points and known truth.

    Deviations are those of A: its nodes and its bark from those of B, its volume above or below that of B.
    """
    cloud, truth, align = (against[key] for key in ("cloud", "truth", "align"))
    _check_usage(a, b, (cloud, truth, align))
    if html is not None:
        options.check_target(html, (".html", ".htm"), overwrite=overwrite)
    if b is not None:
        found = _models(a, b, "root" if align == "root" else "none")
    else:
        found = _measured(a, _path(cloud), _path(truth))
    for note in found.notes:
        log.warning("%s", note)
    others = {"B": b, "cloud": _path(cloud), "truth": _path(truth)}
    given = {label: path for label, path in others.items() if path is not None}
    if html is not None:
        from pipeline.accuracy.page import page
        from pipeline.output import write_text

        write_text(html, page(found, a=a.name, b=" and ".join(path.name for path in given.values())))
    click.echo(found.to_json() if as_json else _text(found, {"A": a, **given}))


def _check_usage(a: Path, b: Path | None, against: tuple[object, object, object]) -> None:
    cloud, truth, align = against
    if b is None and cloud is None and truth is None:
        msg = f"{a}: nothing to compare it with; give a second model, --cloud or --truth"
        raise UsageError(msg)
    if b is not None and (cloud is not None or truth is not None):
        msg = f"{b}: a second model does not go with --cloud and --truth; compare with one after the other"
        raise UsageError(msg)
    if b is None and align == "root":
        msg = "--align root moves a model on to another one; points and truth are compared where they stand"
        raise UsageError(msg)


def _models(a: Path, b: Path, align: Literal["root", "none"]) -> Comparison:
    from pipeline.accuracy import compare
    from pipeline.exchange import read_model

    mine, theirs = read_model(a), read_model(b)
    for file, model in ((a, mine), (b, theirs)):
        options.warn_if_flat(file, model)
    with _about(f"{a} (A) and {b} (B)"):
        found = compare(mine, theirs, align=align)
    return replace(found, bytes={"a": _size(a), "b": _size(b)})


def _measured(a: Path, cloud: Path | None, truth: Path | None) -> Comparison:
    from pipeline.accuracy import compare_cloud, compare_truth
    from pipeline.cloud import read_cloud
    from pipeline.exchange import read_model
    from pipeline.synthetic.truth import read_truth

    model = read_model(a)
    options.warn_if_flat(a, model)
    known = None if truth is None else read_truth(truth)
    if cloud is not None:
        points = read_cloud(cloud)
        with _about(f"{a} and {cloud}"):
            found = compare_cloud(model, points, known)
        return replace(found, bytes={"a": _size(a), "b": None})
    assert known is not None  # usage is checked
    with _about(f"{a} and {truth}"):
        return replace(compare_truth(model, known), bytes={"a": _size(a), "b": None})


@contextmanager
def _about(files: str) -> Iterator[None]:
    """Put the names of two files in front of an error's text."""
    try:
        yield
    except PipelineError as error:
        msg = f"{files}: {error}"
        raise type(error)(msg) from error


def _size(path: Path) -> int | None:
    """Return the size of a file; None of a tree within an archive."""
    return path.stat().st_size if path.is_file() else None


def _path(value: object) -> Path | None:
    return value if isinstance(value, Path) else None


def _text(found: Comparison, files: dict[str, Path]) -> str:
    from pipeline.accuracy.tables import as_text

    heads = "\n".join(f"{label:<6} {path}" for label, path in files.items())
    return f"{heads}\n\n{as_text(found)}"
