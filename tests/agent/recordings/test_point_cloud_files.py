"""Clouds of every kind are read exactly, and damaged ones are refused in one sentence."""

import re
import struct

import numpy as np
import pytest

from agent.errors import BadInput
from agent.recordings.lzf import unpack_lzf
from agent.recordings.point_cloud_files import read_cloud, read_columns
from tests.agent.recordings.cloud_making import as_lzf, axes, pcd_bytes, ply_bytes, written
from tests.counting import counted_calls

ENCODINGS = ("ascii", "binary", "binary_compressed")
FORMATS = ("ascii", "binary_little_endian", "binary_big_endian")
COUNT = 60


@pytest.fixture
def points() -> np.ndarray:
    return (np.random.default_rng(0).uniform(-0.3, 0.3, (COUNT, 3)) + (0, 0, 1)).astype(np.float32)


@pytest.fixture
def colors() -> np.ndarray:
    found = np.random.default_rng(1).integers(0, 255, (COUNT, 3), dtype=np.uint8)
    found[0] = 255
    return found


def packed(colors: np.ndarray, alpha: int = 0) -> np.ndarray:
    red, green, blue = colors.astype(np.uint32).T
    return alpha << 24 | red << 16 | green << 8 | blue


def padding(kind: str, count: int) -> tuple[str, str, np.ndarray]:
    values = np.random.default_rng(2).integers(0, 100, (COUNT, count)).astype(kind)
    return "_", kind, values


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_padding_repeated_and_unknown_fields_are_skipped(tmp_path, points, colors, encoding, kind):
    x, y, z = axes(points, kind)
    columns = [
        padding("u1", 3), x, y, padding("u1", 4), ("label", "u4", np.arange(COUNT)),
        ("label", "u1", np.ones((COUNT, 16))), z, ("x", "f4", np.full(COUNT, 9.0)), ("vfh", "f4", np.ones((COUNT, 30))),
        ("rgb", "u4", packed(colors)),
        ("t", "i8", np.arange(COUNT)), padding("u1", 12),
    ]  # fmt: skip
    found, color, notes = read_cloud(written(tmp_path / "a.pcd", pcd_bytes(columns, encoding)))
    np.testing.assert_array_equal(found[0], points)
    np.testing.assert_array_equal(color[0], colors)
    assert notes == ()
    label = read_columns(tmp_path / "a.pcd", ("label",))[2]["label"]
    np.testing.assert_array_equal(label, np.arange(COUNT))


def test_compressed_points_without_their_padding(tmp_path, points):
    columns = [*axes(points)[:2], padding("u1", 4), axes(points)[2]]
    content = pcd_bytes(columns, "binary_compressed")
    head = content[: content.index(b"binary_compressed\n") + len(b"binary_compressed\n")]
    raw = points.T.tobytes()
    body = as_lzf(raw)
    found, _, _ = read_cloud(written(tmp_path / "a.pcd", head + struct.pack("<II", len(body), len(raw)) + body))
    np.testing.assert_array_equal(found[0], points)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("kind", ["i2", "i4", "i8", "u2", "u8"])
def test_whole_coordinates_are_read_and_their_unit_is_told(tmp_path, points, encoding, kind):
    whole = np.abs(np.rint(points * 1000)).astype(kind)
    found, _, notes = read_cloud(written(tmp_path / "a.pcd", pcd_bytes(axes(whole, kind), encoding)))
    np.testing.assert_allclose(found[0], whole / 1000, atol=1e-6)
    assert "millimetres" in notes[0]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_an_organised_cloud_keeps_its_rows_and_what_was_not_measured(tmp_path, points, encoding):
    points[7] = np.nan
    points[8, 1] = np.inf
    expected = points.copy()
    expected[8] = np.nan
    found, color, _ = read_cloud(written(tmp_path / "a.pcd", pcd_bytes(axes(points), encoding, (10, 6))))
    np.testing.assert_array_equal(found, expected.reshape(6, 10, 3))
    assert color is None


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_colours_of_clouds(tmp_path, points, colors, encoding):
    fractions = colors / 255
    ways = {
        "packed": [("rgb", "u4", packed(colors))],
        "packed with alpha": [("rgba", "u4", packed(colors, 255))],
        "packed in a signed number": [("rgb", "i4", packed(colors, 255).view(np.int32))],
        "three in one field": [("rgb", "u1", colors)],
        "bytes": [(name, "u1", colors[:, k]) for k, name in enumerate("rgb")],
        "16 bits": [(name, "u2", colors[:, k].astype(np.uint16) << 8 | 7) for k, name in enumerate("rgb")],
        "bytes in 16 bits": [(name, "u2", colors[:, k]) for k, name in enumerate("rgb")],
        "floats": [(name, "f4", fractions[:, k].astype(np.float32)) for k, name in enumerate("rgb")],
        "doubles": [(name, "f8", fractions[:, k]) for k, name in enumerate(("red", "green", "blue"))],
        "floats up to 255": [(name, "f4", colors[:, k].astype(np.float32)) for k, name in enumerate("rgb")],
    }
    if encoding != "ascii":
        ways["packed in a float"] = [("rgb", "f4", packed(colors).view(np.float32))]
    for name, columns in ways.items():
        path = written(tmp_path / "a.pcd", pcd_bytes([*columns, *axes(points)], encoding))
        np.testing.assert_array_equal(read_cloud(path)[1], colors[None], err_msg=name)


@pytest.mark.parametrize("spelling", ["whole", "float"])
def test_packed_colours_in_text_are_whole_numbers_or_the_float_of_their_bits(tmp_path, points, colors, spelling):
    bits = packed(colors)
    shown = bits if spelling == "whole" else bits.view(np.float32).astype(float)
    content = pcd_bytes([*axes(points), ("rgb", "f8", shown)], "ascii", SIZE="4 4 4 4")
    np.testing.assert_array_equal(read_cloud(written(tmp_path / "a.pcd", content))[1], colors[None])


def test_colours_that_are_none_are_told(tmp_path, points):
    columns = [*axes(points), *((name, "f4", np.full(COUNT, 1e9)) for name in "rgb")]
    _, color, notes = read_cloud(written(tmp_path / "a.pcd", pcd_bytes(columns)))
    assert color is None and notes == ("its colours were left out: r, g, b are not red, green and blue",)
    half = written(tmp_path / "b.pcd", pcd_bytes([*axes(points), ("r", "u1", np.ones(COUNT))]))
    assert "left out" in read_cloud(half)[2][0]


def lists_before(kind: str, lengths: tuple[int, ...]) -> tuple[str, bytes]:
    """Lines of a header and the rows of an element with a list, and of one without."""
    before = (
        f"element camera {len(lengths)}\nproperty list uchar float view\nproperty short id\n"
        "element range_grid 2\nproperty int first\n"
    )
    if kind == "ascii":
        rows = "".join(" ".join(map(str, (n, *[0.5] * n, 3))) + "\n" for n in lengths) + "1\n2\n"
        return before, rows.encode()
    order = ">" if "big" in kind else "<"
    rows = b"".join(struct.pack(f"{order}B{n}fh", n, *[0.5] * n, 3) for n in lengths)
    return before, rows + struct.pack(f"{order}ii", 1, 2)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("lengths", [(), (4, 4, 4), (0, 3, 1)])
def test_vertices_behind_other_elements_with_lists(tmp_path, points, colors, kind, lengths):
    before, rows = lists_before(kind, lengths)
    columns = [*axes(points, "f8"), *((name, "u1", colors[:, k]) for k, name in enumerate(("red", "green", "blue")))]
    found, color, _ = read_cloud(written(tmp_path / "a.ply", ply_bytes(columns, kind, before, rows)))
    np.testing.assert_array_equal(found[0], points)
    np.testing.assert_array_equal(color[0], colors)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("lengths", [[2] * COUNT, [k % 3 for k in range(COUNT)]])
def test_lists_of_vertices_are_skipped(tmp_path, points, kind, lengths):
    x, y, z = axes(points)
    text = ply_bytes([x, y, z], kind).replace(
        b"property float y\n", b"property float y\nproperty list uchar ushort seen_by\n"
    )
    head = text[: text.index(b"end_header\n") + 11]
    order = ">" if "big" in kind else "<"
    rows = []
    for point, n in zip(points.tolist(), lengths, strict=True):
        if kind == "ascii":
            rows.append(" ".join(map(str, (*point[:2], n, *[7] * n, point[2]))).encode() + b"\n")
        else:
            rows.append(struct.pack(f"{order}ffB{n}Hf", *point[:2], n, *[7] * n, point[2]))
    np.testing.assert_array_equal(read_cloud(written(tmp_path / "a.ply", head + b"".join(rows)))[0][0], points)


@pytest.mark.parametrize("kind", FORMATS)
def test_colours_of_ply_clouds(tmp_path, points, colors, kind):
    for names in (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), tuple("rgb")):
        for of, values in (("u1", colors), ("u2", colors.astype(np.uint16) * 257), ("f4", colors / 255)):
            columns = [*axes(points), *((name, of, values[:, k].astype(of)) for k, name in enumerate(names))]
            path = written(tmp_path / "a.ply", ply_bytes(columns, kind))
            np.testing.assert_array_equal(read_cloud(path)[1][0], colors, err_msg=f"{names} {of}")


@pytest.mark.parametrize("ending", [b"\r\n", b"\r"])
@pytest.mark.parametrize("kind", FORMATS)
def test_lines_of_other_systems(tmp_path, points, kind, ending):
    content = ply_bytes(axes(points), kind)
    at = content.index(b"end_header\n") + 11
    body = content[at:] if kind != "ascii" else content[at:].replace(b"\n", ending)
    path = written(tmp_path / "a.ply", content[:at].replace(b"\n", ending) + body)
    np.testing.assert_array_equal(read_cloud(path)[0][0], points)


def refused(path, said: str) -> str:
    with pytest.raises(BadInput, match=said) as caught:
        read_cloud(path)
    sentence = str(caught.value)
    assert path.name in sentence and "\n" not in sentence and len(sentence) < 1000
    return sentence


@pytest.mark.parametrize(
    ("said", "part"),
    [
        ({"WIDTH": "1000000000000", "POINTS": "1000000000000"}, "claims 1000000000000 points; at most 20000000"),
        ({"WIDTH": "4294967296", "HEIGHT": "4294967296", "POINTS": "18446744073709551616"}, "18446744073709551616"),
        ({"WIDTH": "19999999", "POINTS": "19999999"}, "cut short: it claims 19999999 points"),
        ({"WIDTH": "-1"}, "WIDTH has '-1'"),
        ({"WIDTH": "61", "POINTS": "61"}, "cut short"),
        ({"COUNT": "1 1 100000000"}, "100000000 values a point; legal: 1|each point has"),
        ({"COUNT": "1 1 0"}, "no x, y and z"),
        ({"SIZE": "4 4 3"}, "its field 'z' has values of 3 bytes of a type that is not read"),
        ({"TYPE": "F F V"}, "its field 'z' has values of 4 bytes of a type that is not read"),
        ({"TYPE": "F F"}, "TYPE has 2 entries for 3 fields"),
        ({"FIELDS": "x y"}, "SIZE has 3 entries for 2 fields"),
        ({"FIELDS": "x y y"}, "no x, y and z; its fields are: x, y, y"),
        ({"FIELDS": "x y _"}, "no x, y and z"),
        ({"FIELDS": "x " * 16000, "SIZE": "4 " * 16000}, "TYPE has 3 entries for 16000 fields|no line DATA"),
        ({"DATA": "ascii"}, "values in place of 3|where a number belongs|of 60 points"),
    ],
)
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_headers_that_lie(tmp_path, points, said, part, encoding):
    path = written(tmp_path / "a.pcd", pcd_bytes(axes(points), encoding, **said))
    if encoding != "ascii" or "DATA" not in said:
        refused(path, part if encoding != "binary_compressed" else f"{part}|it says that it unpacks")


@pytest.mark.parametrize(
    ("head", "part"),
    [
        ("element vertex 1000000000000", "claims 1000000000000 points"),
        ("element vertex 19999999", "cut short"),
        ("element vertex -1", "'-1' where a whole number belongs"),
        ("element vertex 0", "empty"),
        ("element points 60", "no vertices"),
        ("element other 1000000000000\nproperty float x\nelement vertex 60", "cut short"),
        ("element other 1000000000000\nelement vertex 60", None),  # of nothing
        ("element other 9\nproperty list uchar double x\nelement vertex 60", "cut|damaged|belongs|too few|in place"),
        ("element vertex 60\nproperty list float int x", "is not a whole number"),
        ("element vertex 60\nproperty quaternion x", "'quaternion'; legal: char"),
        ("element vertex 60\nproperty list int uchar n", "cut short|damaged|belongs|too few|in place"),
        ("element vertex 60\nrpoperty float x", "line 'rpoperty float x'"),
    ],
)
@pytest.mark.parametrize("kind", FORMATS)
def test_ply_headers_that_lie(tmp_path, points, kind, head, part):
    content = ply_bytes(axes(points), kind).replace(b"element vertex 60", head.encode(), 1)
    path = written(tmp_path / "a.ply", content)
    if part is None:
        np.testing.assert_array_equal(read_cloud(path)[0][0], points)
    else:
        refused(path, part)


def test_decimal_commas_are_named(tmp_path, points):
    content = pcd_bytes(axes(points), "ascii")
    at = content.index(b"ascii\n") + 6
    path = written(tmp_path / "a.pcd", content[:at] + content[at:].replace(b".", b","))
    refused(path, "point 1 has '.*,.*' where a number belongs; write decimals with a point")


def test_packed_points_that_lie(tmp_path, points):
    whole = pcd_bytes(axes(points), "binary_compressed")
    at = whole.index(b"compressed\n") + 11
    compressed, unpacked = struct.unpack_from("<II", whole, at)
    body = whole[at + 8 :]

    def changed(sizes: tuple[int, int], content: bytes = body, head: bytes = whole[:at]):
        return written(tmp_path / "a.pcd", head + struct.pack("<II", *sizes) + content)

    refused(changed((2**32 - 1, unpacked)), "cut short")
    refused(changed((compressed, 2**32 - 1)), "unpacks to 4294967295 bytes, but 60 points have 720")
    refused(changed((compressed - 5, unpacked)), "unpack to|cut short")
    refused(changed((3, unpacked), b"\xff\xff\xff"), "at most 264 are read")
    refused(changed((compressed, unpacked), bytes([0xE0, 255, 255]) + body[3:]), "before their beginning")
    many = whole[:at].replace(b" 60\n", b" 19999999\n")
    refused(changed((len(body), 19_999_999 * 12), body, many), "at most")


def test_lzf():
    rng = np.random.default_rng(3)
    for share in (0.0, 0.5, 0.99):
        data = rng.integers(0, 256, 20_000).astype(np.uint8)
        data[rng.random(20_000) < share] = 7
        assert unpack_lzf(as_lzf(data.tobytes()), 20_000) == data.tobytes()
    data = b"abc" * 100
    for cut in range(len(as_lzf(data))):
        with pytest.raises(BadInput, match="packed points"):
            unpack_lzf(as_lzf(data)[:cut], len(data))
    with pytest.raises(BadInput, match="more than 299"):
        unpack_lzf(as_lzf(data), 299)


def test_a_lie_costs_no_more_than_the_truth(tmp_path, points):
    """Nothing is made for points that are claimed and not there."""
    with counted_calls() as steps:
        read_cloud(written(tmp_path / "a.pcd", pcd_bytes(axes(points), "ascii")))
    for content in (
        pcd_bytes(axes(points), "ascii", WIDTH="20000000", POINTS="20000000"),
        pcd_bytes(axes(points), WIDTH="20000000", POINTS="20000000"),
        pcd_bytes(axes(points), "binary_compressed", WIDTH="20000000", POINTS="20000000"),
    ):
        with counted_calls() as lying:
            refused(written(tmp_path / "b.pcd", content), "claims|unpack")
        assert lying.count <= steps.count


def seeds(points: np.ndarray, colors: np.ndarray) -> list[tuple[str, bytes]]:
    columns = [*axes(points[:12]), padding("u1", 2), ("rgb", "u4", packed(colors[:12]))]
    columns[3] = ("_", "u1", columns[3][2][:12])
    found = [("pcd", pcd_bytes(columns, encoding, (4, 3))) for encoding in ENCODINGS]
    for kind in FORMATS:
        before, rows = lists_before(kind, (1, 2))
        names = enumerate(("red", "green", "blue"))
        colored = [*axes(points[:12]), *((name, "u1", colors[:12, k]) for k, name in names)]
        found.append(("ply", ply_bytes(colored, kind, before, rows)))
    return found


WORDS = (b"0", b"-1", b"1", b"3", b"8", b"20000001", b"99999999999999999999", b"nan", b"_", b"x", b"rgb", b"list", b"",
         b"U", b"ascii", b"binary", b"double", b"vertex", b"\xff\xfe")  # fmt: skip


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """The content with some of its bytes, or of the words of its header, changed."""
    way = rng.integers(6)
    if way == 0:
        return content[: rng.integers(len(content))]
    changed = bytearray(content)
    if way == 1:
        for _ in range(rng.integers(1, 9)):
            changed[rng.integers(len(changed))] = rng.integers(256)
    elif way == 2:
        at = rng.integers(len(changed))
        changed[at : at + rng.integers(1, 40)] = rng.bytes(rng.integers(40))
    else:
        end = re.search(rb"DATA \w+\n|end_header\n", content).end()
        lines = content[:end].split(b"\n")
        at = rng.integers(len(lines))
        words = lines[at].split() or [b""]
        if way == 3:
            words[rng.integers(len(words))] = WORDS[rng.integers(len(WORDS))]
        elif way == 4:
            words = [*words, *words[1:]]
        lines[at : at + 1] = [b" ".join(words)] * (1 if way < 5 else rng.integers(3))
        return b"\n".join(lines) + content[end:]
    return bytes(changed)


def test_any_damage_gives_a_cloud_or_one_sentence(tmp_path, points, colors):
    rng = np.random.default_rng(4)
    read = 0
    for suffix, content in seeds(points, colors):
        for _ in range(150):
            path = written(tmp_path / f"a.{suffix}", damaged(content, rng))
            try:
                found, color, _ = read_cloud(path)
            except BadInput as error:
                assert path.name in str(error) and "\n" not in str(error)
                continue
            read += 1
            assert found.shape[2] == 3 and (color is None or color.shape == found.shape)
    assert 100 < read < 800  # both happen
