"""Makes the files of this folder with GDAL (rasterio 1.4.4, GDAL 3.10.3): one field of heights in many formats.

The sample of column i, row r (from the north) is s = (7 i + 13 r) mod 101 + i, the height 0.25 s - 10; column 5, row 3
has no data where the format can say so. 37 columns 2.5 m apart, 29 rows 4 m apart, the north-west corner of the
north-west pixel at x = 1000, y = 2000.
"""
import numpy
import rasterio
from rasterio.transform import from_origin

NX, NY = 37, 29
i, r = numpy.meshgrid(numpy.arange(NX), numpy.arange(NY))
samples = (7 * i + 13 * r) % 101 + i
heights = 0.25 * samples - 10.0
hole = (i == 5) & (r == 3)


def write(name, kind, data, missing=None, scale=None, crs="EPSG:32633", driver="GTiff", point=False, **options):
    data = data.astype(kind)
    if missing is not None:
        data = numpy.where(hole, numpy.array(missing, dtype=kind), data)
    profile = dict(driver=driver, width=NX, height=NY, count=1, dtype=kind, nodata=missing, crs=crs,
                   transform=from_origin(1000.0, 2000.0, 2.5, 4.0), **options)
    with rasterio.open(name, "w", **profile) as f:
        f.write(data, 1)
        if scale is not None:
            f.scales, f.offsets = [scale[0]], [scale[1]]
        if point:
            f.update_tags(AREA_OR_POINT="Point")


tiles = dict(tiled=True, blockxsize=16, blockysize=16)
write("f32_tiles_lzw_predictor3.tif", "float32", heights, -3.4028234663852886e38, compress="lzw", predictor=3, **tiles)
write("f64_strips_deflate_predictor3.tif", "float64", heights, -9999.0, compress="deflate", predictor=3, blockysize=5)
write("f32_tiles_deflate_bigtiff.tif", "float32", heights, numpy.nan, compress="deflate", bigtiff="yes", **tiles)
write("f32_strips_big_endian.tif", "float32", heights, -9999.0, endianness="big", blockysize=3)
write("f64_tiles_big_endian_deflate.tif", "float64", heights, -9999.0, endianness="big", compress="deflate", **tiles)
write("i16_big_endian_lzw_predictor2_scaled.tif", "int16", samples, -32768, (0.25, -10.0), endianness="big",
      compress="lzw", predictor=2, blockysize=4)
write("u16_tiles_deflate_predictor2_scaled.tif", "uint16", samples, 65535, (0.25, -10.0), compress="deflate",
      predictor=2, **tiles)
write("i32_packbits_scaled.tif", "int32", samples, -2147483648, (0.25, -10.0), compress="packbits")
write("u32_lzw_scaled.tif", "uint32", samples, 4294967295, (0.25, -10.0), compress="lzw", predictor=2)
write("u8_scaled.tif", "uint8", samples, 255, (0.25, -10.0), **tiles)
write("i8_scaled.tif", "int8", samples - 100, -128, (0.25, 15.0), compress="lzw")
write("f32_point.tif", "float32", heights, -9999.0, point=True)
write("f32_feet.tif", "float32", heights, -9999.0, crs="EPSG:2263")
write("f32_degrees.tif", "float32", heights, -9999.0, crs="EPSG:4326")
write("grid.asc", "float32", heights, -9999.0, driver="AAIGrid", decimal_precision=4)
write("grid.xyz", "float32", heights, -9999.0, driver="XYZ")
write("grey8.bmp", "uint8", samples, driver="BMP")
write("grey16.png", "uint16", 257 * samples, driver="PNG")
write("pds4_i16.xml", "int16", samples, -32768, (0.25, -10.0), driver="PDS4")
write("pds4_f32.xml", "float32", heights, -3.4028234663852886e38, driver="PDS4")

profile = dict(driver="GTiff", width=NX, height=NY, count=2, dtype="uint8", crs="EPSG:32633",
               transform=from_origin(1000.0, 2000.0, 2.5, 4.0))
for name, interleave in [("two_bands.tif", "pixel"), ("two_planes.tif", "band")]:
    with rasterio.open(name, "w", interleave=interleave, **profile) as f:
        f.write(samples.astype("uint8"), 1)
        f.write(samples.astype("uint8"), 2)

# Two files in feet: one by the unit of the band, and one by a vertical reference system (NAVD88 in US survey feet).
# Heights of the band in feet are multiplied by 1/0.3048.
write("f64_unit_feet.tif", "float64", heights / 0.3048, -9999.0)
with rasterio.open("f64_unit_feet.tif", "r+") as f:
    f.units = ["ft"]
write("f64_vertical_feet.tif", "float64", heights * 3937.0 / 1200.0, -9999.0, crs="EPSG:32633+6360")

# Files with missing data: an internal mask, tiles that are not stored, and special pixels of ISIS.
with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True):
    write("f32_mask.tif", "float32", heights, compress="deflate")
    with rasterio.open("f32_mask.tif", "r+") as f:
        f.write_mask(numpy.where(hole, 0, 255).astype("uint8"))
with rasterio.open("f32_sparse.tif", "w", driver="GTiff", width=NX, height=NY, count=1, dtype="float32", nodata=-9999.0, crs="EPSG:32633",
                   transform=from_origin(1000.0, 2000.0, 2.5, 4.0), sparse_ok=True, **tiles) as f:
    f.write(heights[:16, :16].astype("float32"), 1, window=rasterio.windows.Window(0, 0, 16, 16))
special = heights.astype("float32")
special[3, 5:10] = numpy.arange(0xFF7FFFFB, 0xFF800000, dtype="uint32").view("float32")
write("f32_isis.tif", "float32", special)

# Files with heights far from zero: radii of the Moon in 64 bits, and as an offset of the band.
write("f64_radius.tif", "float64", heights + 1737400.0, -9999.0)
write("i16_radius_offset.tif", "int16", samples, -32768, (0.25, 1737390.0))

# A file with the southern row first, in degrees on Mars's ellipsoid between 18.3 and 18.59 degrees
# of latitude.
with rasterio.open("f32_from_south.tif", "w", driver="GTiff", width=NX, height=NY, count=1, dtype="float32", nodata=-9999.0, crs="EPSG:32633",
                   transform=rasterio.Affine(2.5, 0, 1000.0, 0, 4.0, 2000.0 - NY * 4.0)) as f:
    f.write(numpy.where(hole, -9999.0, heights)[::-1].astype("float32"), 1)
mars = "GEOGCRS[\"Mars\",DATUM[\"Mars\",ELLIPSOID[\"Mars\",3396190,169.894447223612]],CS[ellipsoidal,2],AXIS[\"lat\",north],AXIS[\"lon\",east],ANGLEUNIT[\"degree\",0.0174532925199433]]"
with rasterio.open("f32_degrees_mars.tif", "w", driver="GTiff", width=NX, height=NY, count=1, dtype="float32", nodata=-9999.0, crs=mars,
                   transform=from_origin(77.4, 18.595, 0.01, 0.01)) as f:
    f.write(numpy.where(hole, -9999.0, heights).astype("float32"), 1)

# These files use different compressions.
write("f32_zstd.tif", "float32", heights, -9999.0, compress="zstd", **tiles)
write("f32_lerc.tif", "float32", heights, -9999.0, compress="lerc")

# A tile ends where the width of the codes changes: the end code has another width than the decoder of the crate `tiff` expects.
codes = ((66 * i * i + 31 * r * r + 14 * i * r) % 997).astype("int16")
with rasterio.open("i16_tiles_lzw_end.tif", "w", driver="GTiff", width=NX, height=NY, count=1, dtype="int16", compress="lzw",
                   transform=from_origin(0, NY, 1, 1), **tiles) as f:
    f.write(codes, 1)

# Projections that stretch distances: Web Mercator, and simple cylindrical coordinates of Mars with a standard parallel.
stretched = dict(width=NX, height=NY, nodata=-9999.0, count=1, dtype="float32", driver="GTiff", compress="deflate")
for name, crs, north in [
    ("f32_web_mercator.tif", "EPSG:3857", 6000000.0),
    ("f32_cylindrical_mars.tif", "+proj=eqc +lat_ts=-20 +y_0=1000000 +a=3396190 +b=3396190 +units=m", 4000000.0),
]:
    with rasterio.open(name, "w", crs=crs, transform=from_origin(1000.0, north, 2.5, 4.0), **stretched) as f:
        f.write(numpy.where(hole, -9999.0, heights).astype("float32"), 1)
