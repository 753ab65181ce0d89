"""Limits on the size of files from other people and on the time to read them, with the reason for each limit.

A file that exceeds a limit is refused with one sentence that names the file, its size, and the limit; nothing is
truncated silently. Every limit is far above what recorders, scanners and trainers write.
"""

from __future__ import annotations

import errno
from pathlib import Path

# --- recordings ------------------------------------------------------------------------------

# Bytes that one packed piece of a bag (a chunk or a message) may unpack to: recorders pack 1 to 16 MB at once, and a
# piece is held in memory as a whole, together with what is made of it. A small bag's piece may become as large as
# eight of its pictures at most, or as `BAG_UNPACKED_TIMES` says.
BAG_PIECE_BYTES = 256_000_000
BAG_SMALL_PIECE_BYTES = 32_000_000
# Bytes that all pieces of an open bag may unpack to together, whatever its size, and how many times its size they may
# have in a larger one. A few bytes of bz2 or zstd can stand for gigabytes; sensors' data shrink to a tenth at best, and
# every topic is read in a pass of its own, so that a piece counts as often as it is unpacked.
BAG_UNPACKED_BYTES = 512_000_000
BAG_UNPACKED_TIMES = 200
# Messages of an open bag that are read, likewise, and how many for each byte of a larger one. A message has 30 bytes,
# and about 10 where it is packed; each is read several times.
BAG_MESSAGES = 300_000
BAG_MESSAGES_A_BYTE = 4
# Records of pieces that become more than `BAG_UNPACKED_TIMES` larger than they are: such pieces hold flat pictures, and
# not many of them.
BAG_DENSE_RECORDS = 300_000
# Steps of SQLite in an open bag, and for each byte of a larger one; a row that is read takes about 50.
BAG_DATABASE_STEPS = 50_000_000
BAG_DATABASE_STEPS_A_BYTE = 1_000
# Bytes of a message without pictures and points, and of one with transforms, of which 10,000 have 1 MB.
BAG_SMALL_MESSAGE_BYTES = 1_000_000
BAG_TRANSFORMS_BYTES = 32_000_000
# Fields of a point in a cloud: drivers have up to 20.
BAG_POINT_FIELDS = 1_000
# Bytes of temporary files that an open ROS 2 folder of packed files may need, and how many times their size.
BAG_FILE_BYTES = 128_000_000
BAG_FILE_TIMES = 50

# Points of a cloud, and pixels of a picture, that are read at all: industrial depth cameras have 8 million, and 20
# million points take 1 to 2 GB on the way to objects.
MOST_POINTS = 20_000_000
MOST_PIXELS = 20_000_000
# Pixels of all pictures that are looked at for one measurement, unless the first has more: five of 8 million.
MOST_PIXELS_TOGETHER = 40_000_000
# Bytes of a file with a picture: as many pixels of four floats have more, and nobody writes such.
PICTURE_BYTES = 256_000_000
# Bytes that the points of a compressed cloud unpack to: 20 million with colours and normals have 960 MB.
CLOUD_UNPACKED_BYTES = 1_000_000_000

# --- texts -----------------------------------------------------------------------------------

# Bytes of a camera's file: those of data sets have less than 10 kB.
LENS_BYTES = 100_000
# Bytes of a ROS 2 folder's metadata: it has about 1 kB a topic.
METADATA_BYTES = 2_000_000
# Values in a YAML text: a bag of a thousand topics has 20,000.
YAML_VALUES = 100_000
# Levels of a YAML text: metadata has 6.
YAML_LEVELS = 50
# Bytes of a scene file: 40 objects with every key take 10 kB, and a reader that knows lines takes 10 s for a megabyte.
SCENE_BYTES = 200_000
# Bytes of a batch file, which is held in memory as a whole: a million rows or so.
BATCH_BYTES = 256_000_000
# Bytes of one row: 13 keys and an instruction of 200 words take 2 kB.
ROW_BYTES = 100_000

# Bytes of a session: a run with its pictures has 3 MB, and a chat of a hundred turns a hundred times that.
SESSION_BYTES = 500_000_000
# Bytes of its first line, which says what it is and with which options it began: it has less than 2 kB.
SESSION_START_BYTES = 1_000_000
# Bytes of a settings file (ours have 23 keys), and of the file with the options of an evaluation.
SETTINGS_BYTES = 100_000
ABOUT_BYTES = 1_000_000

# --- meshes ----------------------------------------------------------------------------------

# Bytes of a mesh: the largest scans of YCB have 70 MB.
MESH_BYTES = 120_000_000
# Faces of a mesh: the largest scans of YCB have 524,288.
MESH_FACES = 600_000
# Faces that a mesh of the user's is prepared with: one that has more is made coarser first, which moves its surface by
# less than a depth camera can tell. The hull of a round mesh has a corner at every vertex, and time and memory grow
# with them: 327,680 faces took 25 s and 870 MB.
MESH_FINE_FACES = 60_000
# Seconds on the clock for preparing one mesh of more than `SLOW_BYTES`, or more than `MESH_FINE_FACES` in a glTF file:
# 327,680 faces take 6 s of a processor's time, and nine times that where six programs want it.
MESH_SECONDS = 120.0
# Bytes of the text that begins a .glb file, which says what its numbers mean; and the nodes of a mesh file.
GLTF_TEXT_BYTES = 10_000_000
MESH_NODES = 20_000
# Meshes in a folder and its subfolders, and files that are looked at there: a home folder is none of meshes.
FOLDER_MESHES = 1_000
FOLDER_FILES = 20_000
# Distances that are held in memory at once: 32 MB of them.
DISTANCES_AT_ONCE = 4_000_000

# --- slow operations --------------------------------------------------------------------------

# Bytes of meshes, and of a recording or its unpacked data, above which reading reports progress after 2 s.
SLOW_BYTES = 1_000_000
SLOW_BAG_BYTES = 50_000_000

# --- models ----------------------------------------------------------------------------------

# Bytes of a checkpoint's config: ours have 1 kB.
CONFIG_BYTES = 100_000
# Any whole number in a config, such as a width: ours reach 384.
CONFIG_NUMBER = 8_192
# Layers of a network: ours have 4.
CONFIG_LAYERS = 64
# Trainable numbers of a network, 4 bytes each: ours have 2 million.
PARAMETERS = 50_000_000
# Bytes of a checkpoint's weights: those of as many numbers.
WEIGHTS_BYTES = 4 * PARAMETERS


def read_at_most(path: Path, most: int) -> bytes:
    """Read a file up to a limit, independent of its reported size, because a device has no size and no end.

    Raises:
        OSError: if it cannot be read, or has more than `most` bytes.
    """
    with path.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise OSError(errno.EFBIG, f"it has more than {most} bytes, and no more are read", str(path))
    return content
