"""Meshes and maps of heights: random files, written by other programs, read by Linkwork and by the reference program of each format."""

import pathlib
import tempfile

import numpy as np

import common

FOLDER = pathlib.Path(tempfile.mkdtemp())


def meshes(rng):
    """Scenes of several moved shapes, written by trimesh in each format and read by it again: the corners of all triangles, in any order."""
    import trimesh

    scene = trimesh.Scene()
    parent = scene.graph.base_frame
    for number in range(rng.randint(1, 4)):
        shape = rng.choice(["box", "sphere", "cylinder", "torus"])
        if shape == "box":
            mesh = trimesh.creation.box([rng.uniform(0.01, 10) for _ in range(3)])
        elif shape == "sphere":
            mesh = trimesh.creation.icosphere(1, rng.uniform(0.01, 10))
        elif shape == "cylinder":
            mesh = trimesh.creation.cylinder(rng.uniform(0.1, 1), rng.uniform(0.1, 10), sections=rng.randint(3, 9))
        else:
            mesh = trimesh.creation.torus(rng.uniform(1, 3), rng.uniform(0.1, 0.9), 5, 5)
        if rng.random() < 0.3:
            mesh.visual.vertex_colors = np.full((len(mesh.vertices), 4), 200, np.uint8)
        turn = trimesh.transformations.random_rotation_matrix(np.array([rng.random() for _ in range(3)]))
        turn[:3, 3] = [rng.uniform(-5, 5) for _ in range(3)]
        if rng.random() < 0.3:
            turn[:3, :3] *= [rng.uniform(0.5, 2) for _ in range(3)]
        name = f"n{number}"
        scene.add_geometry(mesh, node_name=name, geom_name=f"g{number}", parent_node_name=parent, transform=turn)
        if rng.random() < 0.5:
            parent = name
    kind = rng.choice(["stl", "stl_ascii", "obj", "dae", "glb", "gltf"])
    file = FOLDER / f"scene.{kind.split('_')[0]}"
    if kind in ("stl", "stl_ascii", "dae"):
        # trimesh writes a scene of these formats as one mesh.
        content = scene.to_geometry().export(file_type=kind)
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
    else:
        scene.export(str(file))
    wanted = triangles(trimesh.load_scene(str(file)).to_geometry())
    if kind in ("glb", "gltf"):
        wanted = wanted[..., [0, 2, 1]] * [1, -1, 1]
    told = common.describe().ask_json({"mesh": str(file)})
    if "error" in told:
        return f"{kind}: rejected: {told['error']}"
    mine = np.array(told["corners"]).reshape(-1, 3, 3)
    if len(mine) != len(wanted):
        return f"{kind}: {len(mine)} triangles, not {len(wanted)}"
    off = float(np.abs(ordered(mine) - ordered(wanted)).max())
    # The formats have numbers of 32 bits, or texts with eight digits.
    return None if off < 2e-5 else f"{kind}: corners are {off:.1e} m off"


def triangles(mesh):
    return np.asarray(mesh.triangles)


def ordered(corners):
    """Triangles by a key that small errors do not change; each begins with the corner that has the least key, so that its orientation is kept."""

    def key(p):
        # With random weights, distinct corners have distinct keys.
        return float(p @ [0.7310585, 1.3132617, 2.1269280])

    out = [np.roll(t, -min(range(3), key=lambda k: key(t[k])), axis=0) for t in corners]
    return np.array(sorted(out, key=lambda t: key(t[0]) + 0.37 * key(t[1]) + 0.11 * key(t[2])))


def maps(rng):
    """GeoTIFF files of rasterio with random types, layouts, compressions, places and missing data."""
    import rasterio

    kind = rng.choice(["int16", "uint16", "int32", "float32", "float64", "uint8", "int8"])
    width, height = rng.randint(2, 90), rng.randint(2, 90)
    real = kind.startswith("float")
    low, high = {"uint8": (1, 254), "int8": (-126, 126)}.get(kind, (1, 3000))
    data = np.array([[rng.uniform(low, high) for _ in range(width)] for _ in range(height)])
    data = data.astype(kind) if real else np.round(data).astype(kind)
    nodata = rng.choice([None, 0, low - 1 if kind != "uint8" else 255])
    if nodata is not None and real and rng.random() < 0.5:
        nodata = rng.choice([float("nan"), -3.4028234663852886e38])
    if nodata is not None:
        holes = np.array([[rng.random() < 0.1 for _ in range(width)] for _ in range(height)])
        data[holes] = nodata
    options = {"driver": "GTiff", "width": width, "height": height, "count": 1, "dtype": kind, "nodata": nodata}
    options["compress"] = rng.choice(["none", "deflate", "lzw", "packbits", "zstd"])
    if options["compress"] in ("deflate", "lzw", "zstd"):
        options["predictor"] = rng.choice([1, 2, 3] if real else [1, 2])
    if rng.random() < 0.5:
        options |= {"tiled": True, "blockxsize": 16, "blockysize": 16}
    else:
        options["blockysize"] = rng.randint(1, height)
    if rng.random() < 0.3:
        options["BIGTIFF"] = "YES"
    if rng.random() < 0.4:
        options["ENDIANNESS"] = "BIG"
    size = [10 ** rng.uniform(-2, 3) for _ in range(2)]
    west, north = rng.uniform(-1e6, 1e6), rng.uniform(-1e6, 1e6)
    options["transform"] = rasterio.transform.from_origin(west, north, *size)
    options["crs"] = rng.choice(["EPSG:32633", "EPSG:3857"])
    scale, offset = rng.choice([(1.0, 0.0), (0.25, -100.0)])
    file = FOLDER / "map.tif"
    with rasterio.open(file, "w", **options) as out:
        out.write(data, 1)
        if (scale, offset) != (1.0, 0.0):
            out.scales, out.offsets = (scale,), (offset,)
        point = rng.random() < 0.3
        out.update_tags(AREA_OR_POINT="Point" if point else "Area")
    with rasterio.open(file) as back:
        read = back.read(1, masked=True)
        x, y = back.xy(height - 1, 0)
        spacing = back.res
    wanted = np.where(np.ma.getmaskarray(read), np.nan, read.filled(0).astype(float) * scale + offset)[::-1]
    told = common.describe().ask_json({"map": str(file)})
    if "error" in told:
        return f"rejected: {told['error']}: {options}"
    tolerance = 1e-12
    if options["crs"] == "EPSG:3857":
        # Linkwork has true distances, and the origin is the south-west node.
        middle = y + 0.5 * (height - 1) * spacing[1]
        spacing, (x, y), tolerance = [s * k for s, k in zip(spacing, stretch(x, middle))], (0.0, 0.0), 1e-6
    if told["size"] != [width, height] or common.differs(np.divide(told["spacing"], spacing), [1, 1], tolerance):
        return f"size or spacing: {told['size']} {told['spacing']}, not {width} {height} {spacing}"
    if common.differs(told["origin"], [x, y], 1e-9):
        return f"origin: {told['origin']}, not {[x, y]} (point: {point})"
    mine = np.array([np.nan if h is None else h for h in told["heights"]]).reshape(height, width)
    if (np.isnan(mine) != np.isnan(wanted)).any():
        return f"missing nodes: {int((np.isnan(mine) != np.isnan(wanted)).sum())} differ: {options}"
    if np.isnan(wanted).all():
        return None
    off = float(np.nanmax(np.abs(mine - wanted)))
    # Heights are kept in 32 bits.
    return None if off < 2e-3 else f"heights: {off:.1e} m off: {options}"


def stretch(x, y):
    """True distances on WGS 84 per distance in Web Mercator, along x and y, from positions of GDAL 200 m apart."""
    from rasterio.warp import transform

    places = [(x - 100, y), (x + 100, y), (x, y - 100), (x, y + 100)]
    longitude, latitude = (np.radians(a) for a in transform("EPSG:3857", "EPSG:4326", *zip(*places)))
    e2 = (2 - 1 / 298.257223563) / 298.257223563
    normal = 6378137.0 / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    across = normal * np.cos(latitude)
    at = np.array([across * np.cos(longitude), across * np.sin(longitude), normal * (1 - e2) * np.sin(latitude)])
    return [np.linalg.norm(at[:, k + 1] - at[:, k]) / 200 for k in (0, 2)]


CASES = {"meshes": meshes, "maps": maps}
