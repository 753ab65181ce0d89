"""Describe the table, the arm and arrangements as messages for the page: JSON values, arrays as base64.

Lengths in metres, world frame. A motion is the upper three rows of a (4, 4) matrix, row by row; a pose is x, y, z and
the quaternion x, y, z, w. Everything refers to the clouds of a scene, as they were seen then.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from agent import events
from agent.event_base import json_value
from agent.rendering.palette import FAINT, color_of, mean_color
from agent.reporting.event_text import shortcoming
from structdiffusion.geometry import pose_from_xyz_yaw, quaternion_from_matrix
from structdiffusion.observation import ObjectCloud, Table

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene

_QUALITY = 80
_DIGITS = 4  # of a pose: a tenth of a millimetre


def scene_message(
    number: int, table: Table, clouds: Sequence[ObjectCloud], distractors: Sequence[ObjectCloud] = ()
) -> dict[str, Any]:
    """Describe the table and the clouds on it.

    Args:
        number: the number of the scene, to which motions and poses refer.
        table: the table top.
        clouds: of the objects that take part.
        distractors: of the others.
    """
    objects = [_cloud(index, cloud, True) for index, cloud in enumerate(clouds)]
    objects += [_cloud(index, cloud, False) for index, cloud in enumerate(distractors)]
    return {"scene": number, "table": [table.x_min, table.x_max, table.y_min, table.y_max], "objects": objects}


def _cloud(index: int, cloud: ObjectCloud, takes_part: bool) -> dict[str, Any]:
    own = mean_color(cloud.colors)
    color = FAINT if own is None and not takes_part else color_of(index, own)
    colors = None if cloud.colors is None else _base64(np.asarray(cloud.colors)[:, :3].astype(np.uint8))
    return {
        "name": cloud.name,
        "takes_part": takes_part,
        "color": list(color),
        "points": _base64(cloud.points.astype("<f4")),
        "colors": colors,
    }


def arm_message(table: TableScene) -> dict[str, Any]:
    """Describe the solids of the arm."""
    from agent.arm.visual_shapes import joint_shapes, link_shapes

    return {"shapes": [json_value(shape) for shape in (*link_shapes(table.arm), *joint_shapes(table.arm))]}


def poses_message(number: int, table: TableScene, seen: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Describe where everything is now: the motion of each object since it was seen, and the pose of each link.

    Args:
        number: the number of the scene.
        table: the table.
        seen: name -> world_from_object (4, 4) when the clouds of the scene were seen.
    """
    from agent.arm.visual_shapes import link_poses

    now = table.poses()
    return {
        "scene": number,
        "objects": {name: _pose(now[name] @ np.linalg.inv(seen[name])) for name in now if name in seen},
        "links": {str(link): _pose(pose) for link, pose in link_poses(table.arm).items()},
    }


def candidates_message(number: int, proposed: events.Proposed) -> dict[str, Any]:
    """Describe all arrangements of a proposal with their scores, best first."""
    motions = np.array([one.goal_from_initial for one in proposed.arrangements])
    best = proposed.candidates[0].scores
    return {
        "scene": number,
        "names": [cloud.name for cloud in proposed.scene.objects],
        "count": len(proposed.candidates),
        "motions": _motions(motions),
        "scores": [json_value(one.scores.get("total")) for one in proposed.candidates],
        "words": ["the best" if one.rank == 1 else shortcoming(one.scores, best) for one in proposed.candidates],
    }


def preview_message(number: int, clouds: Sequence[ObjectCloud], preview: events.Previewed) -> dict[str, Any]:
    """Describe the first sample of a model that is still denoising.

    Args:
        number: the number of the scene.
        clouds: of the objects that take part, in the order of the preview.
        preview: the samples.
    """
    motions = []
    for cloud, position, turn in zip(clouds, preview.positions[0], preview.turns[0], strict=True):
        back = np.eye(4)
        back[:3, 3] = -cloud.centroid
        motions.append(pose_from_xyz_yaw(*position, turn) @ back)
    return {
        "scene": number,
        "names": [cloud.name for cloud in clouds],
        "motions": _motions(np.array(motions)),
        "step": preview.step,
        "steps": preview.steps,
    }


def picture_message(image: np.ndarray, caption: str) -> dict[str, Any]:
    """Describe a picture (H, W, 3) uint8 of the camera."""
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image[..., :3])).save(buffer, format="JPEG", quality=_QUALITY)
    return {"caption": caption, "jpeg": base64.b64encode(buffer.getvalue()).decode()}


def _pose(pose: np.ndarray) -> list[float]:
    return [round(float(value), _DIGITS) for value in (*pose[:3, 3], *quaternion_from_matrix(pose[:3, :3]))]


def _motions(motions: np.ndarray) -> str:
    return _base64(np.ascontiguousarray(motions[..., :3, :]).astype("<f4"))


def _base64(array: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()
