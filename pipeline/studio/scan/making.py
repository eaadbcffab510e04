"""From what a person wants to see to what is shown; stages that a change leaves alone are kept."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.accuracy import Comparison, compare, compare_cloud
from pipeline.accuracy.bark import nearest_bark
from pipeline.accuracy.wood import wood_of
from pipeline.cloud import clean, read_cloud
from pipeline.config import Config
from pipeline.errors import NotATreeError
from pipeline.exchange import read_model
from pipeline.jobs.naming import named
from pipeline.model import Floats, PointCloud, Skeleton, TreeModel
from pipeline.report import report
from pipeline.run import reconstruct
from pipeline.store import Artefact
from pipeline.studio.folders import Folders
from pipeline.studio.scan.beside import NOTHING_BESIDE, Beside
from pipeline.studio.scan.fields import TABLES
from pipeline.studio.scan.opening import Opened, open_scan
from pipeline.studio.scan.stages import MAKING, Caller, Stage, Stages, at_once

SAME_M = 1e-4  # cleaning moves points to a raster of a hundredth of a millimetre
KEPT = 6  # results that are kept, so that undo is quick


@dataclass(frozen=True, eq=False)
class Result:
    """A model with what is known of it.

    Parameters
    ----------
    name : str
    tree : TreeModel or Skeleton
    config : Config
    figures : mapping
        Keys of report.json.
    used : PointCloud or None
        The points that it was fitted to.
    leaves, rest : (K, 3) arrays
        Points that cleaning took for leaves, and all others that it left out, metres in the cloud's system.
    off : Comparison or None
        How far the points that were used lie from the model.
    near : (P,) array of int or None
        The segment nearest to each of them: one less than its node; None where radii are not known.
    stages : tuple of str
        The stages that were made for it; the others were kept from before.
    """

    name: str
    tree: TreeModel | Skeleton
    config: Config
    figures: Mapping[str, Any]
    used: PointCloud | None = None
    leaves: Floats | None = None
    rest: Floats | None = None
    off: Comparison | None = None
    near: NDArray[np.int64] | None = None
    stages: tuple[str, ...] = ()


class Wish(NamedTuple):
    """What is to be shown.

    Attributes
    ----------
    path : Path
        A cloud, a model, or the folder of a run.
    turn : int
        Another one reads the file again.
    config : Config or None
        None is what the file itself tells, else the defaults.
    other : Path or Config or None
        The model to compare with: a file, or the result of other options.
    aligned : bool
        Whether the model is moved so that its root is that of the other one, for the comparison.
    beside : Beside
        What is known beside the points.
    """

    path: Path
    turn: int
    config: Config | None = None
    other: Path | Config | None = None
    aligned: bool = False
    beside: Beside = NOTHING_BESIDE


class Shown(NamedTuple):
    """What is shown."""

    wish: Wish
    opened: Opened
    result: Result
    other: Result | None = None
    compared: Comparison | None = None


class Maker:
    """Makes what is wished for and keeps what may be needed again.

    Parameters
    ----------
    folders : Folders
    call : callable, optional
        Where what takes long is done.
    """

    def __init__(self, folders: Folders, call: Caller = at_once) -> None:
        self._folders, self._call = folders, call
        self._opened: tuple[tuple[Path, int], Opened] | None = None
        self._store = Stages(call)
        self._ground: PointCloud | None = None
        self._beside: tuple[Beside, Opened | None] = NOTHING_BESIDE, None
        self._results: OrderedDict[str, tuple[Result, dict[str, Artefact]]] = OrderedDict()

    def make(self, wish: Wish, told: Callable[[Stage], None]) -> Shown:
        """Make what is wished for.

        Parameters
        ----------
        wish : Wish
        told : callable
            Is told the stage, again and again while it goes on; what it raises ends the making.

        Raises
        ------
        PipelineError
            If a file cannot be read, or the points make no tree.
        """
        self._store.begin(told)
        opened = self._know(self._open(wish, told), wish.beside)
        config = wish.config or opened.config
        with named(opened.path):
            result = self._result(opened, config)
        if wish.other is None:
            return Shown(wish, opened, result)
        if isinstance(wish.other, Config):
            with named(opened.path):
                other = self._result(opened, wish.other)
                self._result(opened, config)
        else:
            other = self._other(wish.other)
        align: Literal["root", "none"] = "root" if wish.aligned else "none"
        found = self._store.do("compare", compare, result.tree, other.tree, align=align)
        return Shown(wish, opened, result, other, found)

    def _open(self, wish: Wish, told: Callable[[Stage], None]) -> Opened:
        """Read what is to be opened, once."""
        key = (wish.path, wish.turn)
        if self._opened is None or self._opened[0] != key:
            opened = open_scan(
                wish.path, self._folders, lambda reader, path: self._store.do("read", reader, path)
            )
            self._store = Stages(self._call)
            self._store.begin(told)
            self._results.clear()
            self._ground, self._beside = None, (NOTHING_BESIDE, None)
            self._opened = key, opened
        return self._opened[1]

    def _know(self, opened: Opened, beside: Beside) -> Opened:
        """Add what is known beside the points; what was made without it is not kept."""
        if beside == self._beside[0]:
            return self._beside[1] or opened
        if opened.cloud is None:
            msg = f"{opened.path}: has no points, so that nothing can be told of them; open the cloud instead"
            raise NotATreeError(msg)
        ground = (
            self._store.do("read", read_cloud, self._folders.inside(beside.ground)) if beside.ground else None
        )
        told = replace(opened, cloud=beside.known(opened.cloud)) if beside != NOTHING_BESIDE else None
        self._results.clear()
        self._ground, self._beside = ground, (beside, told)
        return told or opened

    def _other(self, path: Path) -> Result:
        """Read a second model."""
        real = self._folders.inside(path)
        tree: TreeModel | Skeleton = self._store.do("read", read_model, real)
        return Result(path.name, tree, Config(), figures_of(tree, path.name))

    def _result(self, opened: Opened, config: Config) -> Result:
        """Return the model of a file as it is, or one that is reconstructed with other options."""
        key = "\n".join(getattr(config, table).model_dump_json() for table in TABLES)
        if key not in self._results:
            self._results[key] = self._made(opened, config), dict(self._store.artefacts)
        self._results.move_to_end(key)
        while len(self._results) > KEPT:
            self._results.popitem(last=False)
        result, artefacts = self._results[key]
        self._store.artefacts = dict(artefacts)  # so that the next change goes on from here
        return result

    def _made(self, opened: Opened, config: Config) -> Result:
        store, cloud = self._store, opened.cloud
        as_told = self._beside[0] == NOTHING_BESIDE and same_stages(config, opened.config)
        if opened.model is not None and (cloud is None or as_told):
            if not same_stages(config, opened.config):
                msg = "there are no points to reconstruct from; open the cloud instead"
                raise NotATreeError(msg)
            tree: TreeModel | Skeleton = opened.model
            figures = opened.written or figures_of(tree, opened.name)
        else:
            tree = reconstruct(cloud, config, store, self._ground)  # type: ignore[arg-type]  # what is no model has a cloud
            seconds = {name: took for name, took in store.seconds.items() if name in MAKING}
            known = report(tree, name=opened.name, seconds=seconds, config_hash=config.config_hash)
            figures = {key: value for key, value in known.to_dict().items() if key != "peak_rss_mb"}
        if cloud is None:
            return Result(opened.name, tree, config, figures)
        used = store.remember("clean", clean, cloud, self._ground, options=config.clean)
        whole = None
        if used.metadata["dropped"]["leaf"]:
            kept = config.clean.model_copy(update={"leaves": "keep"})
            whole = store.remember("sort", clean, cloud, self._ground, options=kept)
        leaves, rest = store.remember("rest", sorted_points, cloud, whole, used)
        off, near = store.remember("distances", distances, tree, used)
        return Result(opened.name, tree, config, figures, used, leaves, rest, off, near, tuple(store.made))


def sorted_points(cloud: PointCloud, whole: PointCloud | None, used: PointCloud) -> tuple[Floats, Floats]:
    """Return the points that are leaves, and those that cleaning left out otherwise.

    Parameters
    ----------
    cloud : PointCloud
        As it was read.
    whole : PointCloud or None
        What cleaning keeps of it where leaves are kept; None where there are none.
    used : PointCloud
        What cleaning keeps of it.

    Returns
    -------
    leaves, rest : (K, 3) arrays
        In the system of the cloud, metres.
    """
    kept = used.world if whole is None else whole.world
    given = cloud.world[np.isfinite(cloud.xyz).all(axis=1)]
    rest = given[cKDTree(kept).query(given)[0] > SAME_M]
    leaves = kept[cKDTree(used.world).query(kept)[0] > SAME_M] if whole is not None else kept[:0]
    return leaves, rest


def distances(tree: TreeModel | Skeleton, used: PointCloud) -> tuple[Comparison, NDArray[np.int64] | None]:
    """Return how far points lie from a model, and the segment nearest to each.

    Raises
    ------
    NotComparableError
        If they do not overlap.
    """
    found = compare_cloud(tree, used)
    zero = np.floor(used.world.min(axis=0))
    bark = wood_of(tree).moved(-zero).tubes()
    return found, None if bark is None else nearest_bark(used.world - zero, bark).segment


def same_stages(one: Config, other: Config) -> bool:
    """Tell whether two configs make the same model of the same points."""
    return all(getattr(one, table) == getattr(other, table) for table in TABLES)


def figures_of(tree: TreeModel | Skeleton, name: str) -> Mapping[str, Any]:
    """Return what is known of a model, by the keys of report.json; of a skeleton it is little."""
    if isinstance(tree, TreeModel):
        return report(tree, name=name).to_dict()
    return {
        "name": name,
        "nodes": len(tree),
        "branches": len(tree.paths),
        "max_order": int(tree.order.max()),
        "height_m": float(np.ptp(tree.xyz[:, 2])),
        "length_m": float(tree.length.sum()),
        "flags": sorted(tree.metadata.get("flags", ())),
    }
