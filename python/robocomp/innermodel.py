"""The tree of a component with `options InnerModelViewer;`."""

import logging
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from robocomp._context import Context
from robocomp._errors import StartError
from robocomp._link import Link
from robocomp._load import load

load(
    "robocomp._innermodel",
    "ROBOCOMP_INNERMODEL",
    "rc-python-innermodel",
    "librobocomp_innermodel.so",
)

from robocomp._innermodel import Snapshot, Tree, Window  # noqa: E402

Pose = tuple[float, float, float, float, float, float]
"""x, y, z in millimetres, and the angles about x, y, z in radians."""

Point = tuple[float, float, float]
"""x, y, z in millimetres."""

__all__ = ["InnerModel", "InnerModelContext", "Point", "Pose", "Snapshot"]


class InnerModel:
    """The tree of the file that the parameter `inner_model` names, in versions. Lengths are
    millimetres, angles are radians; a pose is x, y, z and the angles about x, y, z."""

    __slots__ = ("_link", "_tree")

    def __init__(self, link: Link, tree: Tree) -> None:
        self._link = link
        self._tree = tree

    def snapshot(self) -> Snapshot:
        """The present version, which never changes."""
        return self._tree.snapshot()

    def change(
        self,
        joints: Mapping[str, float] | None = None,
        poses: Mapping[str, Pose] | None = None,
    ) -> dict[str, float]:
        """Sets the positions of joints, and poses of nodes in the nodes above them, as one new
        version. Returns the positions that the joints have, within their limits.

        Raises `ValueError` if one of them cannot be set; then nothing has changed.
        """
        joints = joints or {}
        positions = self._tree.change(
            self._link.now_ns(), list(joints.items()), list((poses or {}).items())
        )
        return dict(zip(joints, positions, strict=True))

    def matrix(self, to: str, frame: str) -> npt.NDArray[np.float64]:
        """The homogeneous matrix from the frame `frame` to the frame `to`, of the present version."""
        return np.array(self.snapshot().matrix(to, frame))


class InnerModelContext(Context):
    """The context of a component with a tree, and with a window while the parameter `viewer` is true."""

    tree: InnerModel
    """The tree of the file that the parameter `inner_model` names."""

    def __init__(self, link: Link) -> None:
        super().__init__(link)
        self._window: Window | None = None
        self._shown = False
        self._no_window: str | None = None

    def _show(self, wanted: bool, file: Path) -> None:
        """Takes the parameters `viewer` and `inner_model`."""
        if self._window is not None:
            # The user may have closed the window: another parameter does not open it again.
            if wanted != self._shown and not self._link.is_replay():
                try:
                    self._window.show(wanted)
                except OSError as error:
                    self._no_window = str(error)
            self._shown = wanted
            return
        self._shown = wanted
        # A run that is repeated needs no window.
        opens = wanted and not self._link.is_replay()
        try:
            if opens:
                Window.reach()
            tree, warnings = Tree.read(file)
        except OSError as error:
            raise StartError(
                f"the parameter `viewer` is true: {error}; "
                "set `viewer = false`, or the variable DISPLAY to a display that takes connections"
            ) from None
        except ValueError as error:
            raise StartError(str(error)) from None
        for line in warnings:
            logging.getLogger("robocomp").warning(line)
        self.tree = InnerModel(self._link, tree)
        self._window = Window(self.name, tree)
        try:
            self._window.show(opens)
        except OSError as error:
            # The display was there a moment ago.
            logging.getLogger("robocomp").warning(str(error))

    def _refusal(self) -> str | None:
        refusal, self._no_window = self._no_window, None
        return refusal
