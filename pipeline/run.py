"""One tree from points to files: the method, and what is written of it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from pipeline.cloud import clean
from pipeline.cloud.units import require_metres
from pipeline.config import Config
from pipeline.cylinders import fit
from pipeline.exchange import DEFAULT_FORMATS, FORMATS
from pipeline.growth import Event, GrowthOptions, Shade
from pipeline.growth.carrying import Carrying, through
from pipeline.lsystem import max_error, read_lsjson
from pipeline.model import PointCloud, TreeModel
from pipeline.output import write_text
from pipeline.report import Report, report
from pipeline.skeleton import extract
from pipeline.store import Store
from pipeline.view.picture import picture

log = logging.getLogger(__name__)


def reconstruct(
    cloud: PointCloud,
    config: Config | None = None,
    store: Store | None = None,
    ground: PointCloud | None = None,
) -> TreeModel:
    """Reconstruct one tree: clean its points, extract a skeleton, fit cylinders along it.

    Parameters
    ----------
    cloud : PointCloud
        All points of one tree.
    config : Config, optional
    store : Store, optional
        Keeps what each stage made, and its seconds.
    ground : PointCloud, optional
        Points of the ground, where they are not in `cloud`.

    Returns
    -------
    TreeModel

    Raises
    ------
    NotATreeError
        If no tree can be made of the points.
    InputFormatError
        If the reference system of the points counts in degrees or feet.
    """
    config, store = config or Config(), store or Store()
    require_metres(cloud)
    cloud = store.remember("clean", clean, cloud, ground, options=config.clean)
    skeleton = store.remember("skeleton", extract, cloud, options=config.skeleton)
    return store.remember("fit", fit, cloud, skeleton, options=config.cylinders)


def grow_on(
    tree: TreeModel,
    options: GrowthOptions,
    years: int,
    *,
    seed: int = 0,
    events: Iterable[Event] = (),
    shade: Shade | None = None,
) -> TreeModel:
    """Let a reconstructed tree grow for some years: into metamers, through the years, and back.

    Parameters
    ----------
    tree : TreeModel
    options : GrowthOptions
    years : int
    seed : int
        The same seed gives the same tree.
    events : iterable of Event
        What is done to it, each after the growth of its year.
    shade : Shade, optional
        Neighbours and buildings, relative to the tree's origin.

    Returns
    -------
    TreeModel
        What stood stays where it was; see `pipeline.growth.carried`.

    Raises
    ------
    ModelError
        If the tree has no radii.
    UsageError
        If the years are out of range, or the tree would have too many metamers.
    """
    growth = Carrying(tree, options, seed=seed, shade=shade)
    for _ in through(growth, years, events):
        pass
    return growth.to_model()


@dataclass(frozen=True)
class Outputs:
    """What is written of a tree, and where.

    Parameters
    ----------
    folder : Path
        Made if need be.
    stem : str
        Name of the tree; the files are called ``stem.ls.json`` and so on.
    formats : tuple of str
        Names of `pipeline.exchange.FORMATS`.
    picture : bool
        Draw ``stem.png`` too.
    """

    folder: Path
    stem: str
    formats: tuple[str, ...] = DEFAULT_FORMATS
    picture: bool = True

    def path(self, suffix: str) -> Path:
        """Return the file with this suffix."""
        return Path(self.folder) / f"{self.stem}{suffix}"


def write_outputs(
    tree: TreeModel,
    cloud: PointCloud,
    outputs: Outputs,
    *,
    config: Config | None = None,
    store: Store | None = None,
    warn: Callable[[str], None] = log.warning,
) -> Report:
    """Write a tree in every format that is asked for, its picture, and report.json.

    Parameters
    ----------
    tree : TreeModel
    cloud : PointCloud
        The points to draw; those that cleaning kept are drawn instead where `store` has them.
    outputs : Outputs
    config : Config, optional
    store : Store, optional
        The one of `reconstruct`: its seconds go into the report.
    warn : callable, optional
        Told what is missing though the model is there: a picture on a machine that cannot draw.

    Returns
    -------
    Report
        As written to report.json.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    config, store = config or Config(), store or Store()
    for name in outputs.formats:
        chosen = FORMATS[name]
        store.clock("write", chosen.write, tree, outputs.path(chosen.suffix), config)
    lsystem = store.clock("write", _lsystem_figures, tree, outputs)
    if outputs.picture:
        kept = store.artefacts.get("clean")
        title = report(tree, name=outputs.stem).headline
        points = kept.value if kept else cloud
        try:
            store.clock(
                "write", picture, tree, points, outputs.path(".png"), title=title, options=config.picture
            )
        except RuntimeError as error:  # no graphics, or a driver that fails: the model matters more
            warn(f"no picture: {error}")
    written = report(
        tree,
        name=outputs.stem,
        lsystem=lsystem,
        seconds=store.seconds,
        config_hash=config.config_hash,
    )
    write_text(Path(outputs.folder) / "report.json", written.to_json())
    return written


def _lsystem_figures(tree: TreeModel, outputs: Outputs) -> dict[str, float]:
    """Size of the L-system as written, and how far it is from the model at most."""
    if "lsjson" not in outputs.formats:
        return {}
    path = outputs.path(FORMATS["lsjson"].suffix)
    return {"bytes": path.stat().st_size, "max_error_mm": 1000.0 * max_error(tree, read_lsjson(path))}
