"""`treepipe prune`: one operation on a tree."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from pipeline.cli import growth, options
from pipeline.cli.logs import LOGGER
from pipeline.errors import UsageError

ABOUT = {
    "cut-to-bud": "cut wood off, just above a bud",
    "facing-bud": "cut to the bud nearest the middle that looks a given way",
    "outward": "cut to the bud nearest the middle that looks away from the stem",
    "stake": "tie the stem or branches to a stake at any angle",
    "open-centre": "cut the leader right above its third side branch",
    "espalier": "train tiers of level arms along a wall, year by year",
    "limit-length": "keep branches within a length",
    "crown-raise": "clear the stem up to a height",
    "thin": "take out the branches with the least light",
    "reduce": "cut the crown back to an envelope",
    "bend-and-tie": "bend young wood, and tie it there",
}
"""What each operation does; here, too, so that --help is instant."""

SELECTORS = (
    "  --position X,Y,Z     the branch nearest to a point, within --within-m (0.5)",
    "  --lowest-m, --highest-m M     branches that begin at these heights above the foot",
    "  --order N            0 is the stem, 1 what it bears",
    "  --azimuth-deg A      branches that go there, within --azimuth-within-deg (45)",
    "  --all                every side branch",
)


class _Help(click.Command):
    """The help also lists the operations and how branches are selected."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the lists."""
        del ctx
        with formatter.section("Operations"):
            formatter.write_dl(list(ABOUT.items()))
        with formatter.section("Branches"):
            for line in SELECTORS:
                formatter.write(f"{line}\n")


@click.command("prune", cls=_Help, context_settings={"ignore_unknown_options": True})
@click.argument("words", metavar="MODEL [--PARAMETER VALUE]...", nargs=-1, type=click.UNPROCESSED)
@click.option("--operation", required=True, metavar="NAME", help="What is done; see below.")
@click.option("--all", "every", is_flag=True, help="Do it to every side branch.")
@growth.seed
@growth.parameters
@options.output("a model in any format that treepipe writes")
@options.overwrite
@options.messages
def command(words: Sequence[str], operation: str, every: bool, target: Path, **given: Any) -> None:
    """Prune MODEL, any tree that treepipe reads: a grown one or a reconstruction.

    Wood that stays keeps its place and its radius to the last bit; cuts are made at buds. Parameters of the
    operation are given by their names: --height-m 2.5, --direction 0,0,-1; docs/pruning.md tells all. What
    acts only as the tree grows on, a stake for one, is a matter of `treepipe simulate --events`.
    """
    from pipeline.exchange import format_of
    from pipeline.growth.carrying import Carrying
    from pipeline.growth.pruning import operation_of
    from pipeline.jobs.naming import named
    from pipeline.jobs.pruning import prune
    from pipeline.jobs.standing import read_tree

    model, values = parsed(words)
    pruning = operation_of(operation, values | ({"all": True} if every else {}))
    to = format_of(target)
    options.check_target(target, (to.suffix,), overwrite=given["overwrite"])
    growth.check_model(model)
    tree = read_tree(model)
    options.warn_if_flat(model, tree)
    how, seed = given["how"], given["seed"]
    with named(model):
        pruned, done = growth.tell_of_poles(prune)(tree, pruning, how, seed=seed)
        if done.idle:
            pruning.check_chosen(Carrying(tree, how, seed=seed))
    if done.idle:
        text = "%s: %s finds nothing to do; the tree is as it was. It looks for %s"
        LOGGER.warning(text, model, operation, pruning.sought)
    if done.tied:
        LOGGER.warning("ties act as the tree grows, and files of models have none; use `treepipe simulate`")
    growth.check_writable(target.parent)
    to.write(pruned, target, _config())
    bent = f", {done.bent} bent" if done.bent else ""
    before, after = (float(one.skeleton.length.sum()) for one in (tree, pruned))
    cuts = "1 cut" if done.cuts == 1 else f"{done.cuts} cuts"
    click.echo(f"{target}: {cuts}, {before - after:.2f} m of {before:.2f} m of wood gone{bent}")


def parsed(words: Sequence[str]) -> tuple[Path, dict[str, Any]]:
    """Tell the model from the parameters of the operation.

    Raises
    ------
    UsageError
        If there is no model, more than one, or a parameter without a value.

    Examples
    --------
    >>> parsed(["oak.ls.json", "--height-m", "2.5", "--direction=0,0,-1"])
    (PosixPath('oak.ls.json'), {'height_m': 2.5, 'direction': [0, 0, -1]})
    """
    models, values, rest = [], {}, list(words)
    while rest:
        word = rest.pop(0)
        if not word.startswith("--"):
            models.append(word)
            continue
        name, equals, value = word.partition("=")
        if not equals:
            if not rest:
                msg = f"{name} has no value; give one, for example {name} 1"
                raise UsageError(msg)
            value = rest.pop(0)
        values[name[2:].replace("-", "_")] = _value(value)
    if len(models) != 1:
        msg = f"prune takes one model, not {len(models)}; name it, and give parameters as --NAME VALUE"
        raise UsageError(msg)
    return Path(models[0]), values


def _value(text: str) -> Any:
    """Read a value: a number, three of them with commas between, or a text."""
    for candidate in (text, f"[{text}]"):
        try:
            return tomllib.loads(f"value = {candidate}")["value"]
        except tomllib.TOMLDecodeError:
            continue
    return text


def _config() -> Any:
    from pipeline.config import Config

    return Config()
