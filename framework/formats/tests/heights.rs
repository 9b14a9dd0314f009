//! Heights of ground: files written by GDAL, published files, labels of the Planetary Data System, and rejected files.
use linkwork_formats::heights::{Heights, HeightsError, HeightsOptions, read_heights};
use std::path::PathBuf;

use crate::raster;
use raster::{alone, read, value};

const NX: usize = 37;
const NY: usize = 29;

fn data() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/heights"))
}

fn file(name: &str, options: &HeightsOptions) -> Result<Heights, HeightsError> {
    let bytes = std::fs::read(data().join(name)).unwrap();
    read_heights(name, &bytes, options, &mut |beside| {
        std::fs::read(data().join(beside)).map_err(|e| e.to_string())
    })
}

/// Returns a file of the reference data; without it, the test prints a message and is skipped, and with `CI=true` it fails.
fn reference(name: &str) -> Option<Vec<u8>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/terrain/");
    match std::fs::read(format!("{folder}{name}")) {
        Ok(bytes) => Some(bytes),
        Err(e) if std::env::var("CI").is_ok_and(|v| v == "true") => panic!("{name}: {e}"),
        Err(_) => {
            println!("SKIPPED: no reference file {name}");
            None
        }
    }
}

/// Returns the height of column `i` and line `r` from the north, as in `tests/data/heights/make.py`.
fn made(i: usize, r: usize) -> f32 {
    0.25 * ((7 * i + 13 * r) % 101 + i) as f32 - 10.0
}

/// Asserts that all heights are those of [`made`], within `within`, with the hole if there is one.
fn is_made(name: &str, h: &Heights, hole: bool, within: f32) {
    assert_eq!((h.nx, h.ny, h.heights.len()), (NX, NY, NX * NY), "{name}");
    for r in 0..NY {
        for i in 0..NX {
            let got = h.heights[(NY - 1 - r) * NX + i];
            match hole && (i, r) == (5, 3) {
                true => assert!(got.is_nan(), "{name}: the hole is {got}"),
                false => assert!((got - made(i, r)).abs() <= within, "{name}: {i} {r}: {got}"),
            }
        }
    }
}

#[test]
fn every_geotiff_of_gdal_has_its_heights_and_its_place() {
    let names = [
        "f32_tiles_lzw_predictor3.tif",
        "f64_strips_deflate_predictor3.tif",
        "f32_tiles_deflate_bigtiff.tif",
        "f32_strips_big_endian.tif",
        "f64_tiles_big_endian_deflate.tif",
        "i16_big_endian_lzw_predictor2_scaled.tif",
        "u16_tiles_deflate_predictor2_scaled.tif",
        "i32_packbits_scaled.tif",
        "u32_lzw_scaled.tif",
        "u8_scaled.tif",
        "i8_scaled.tif",
    ];
    for name in names {
        let h = file(name, &HeightsOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        is_made(name, &h, true, 0.0);
        assert_eq!((h.spacing, h.origin), ([2.5, 4.0], [1001.25, 2000.0 - 28.5 * 4.0]), "{name}");
    }
}

#[test]
fn pixels_that_are_points_and_feet_are_where_they_are() {
    // GDAL writes the tie point at the centre of a point pixel, so the node is at the same
    // position.
    let point = file("f32_point.tif", &HeightsOptions::default()).unwrap();
    is_made("points", &point, true, 0.0);
    assert_eq!(point.origin, [1001.25, 1886.0]);
    let feet = file("f32_feet.tif", &HeightsOptions::default()).unwrap();
    is_made("feet", &feet, true, 0.0);
    let foot = 1200.0 / 3937.0;
    for k in 0..2 {
        assert!((feet.spacing[k] - [2.5, 4.0][k] * foot).abs() < 1e-12, "{:?}", feet.spacing);
        assert!((feet.origin[k] - [1001.25, 1886.0][k] * foot).abs() < 1e-9, "{:?}", feet.origin);
    }
}

#[test]
fn heights_in_feet_are_metres() {
    // The first file has the unit in its band, the second in its vertical reference system.
    for name in ["f64_unit_feet.tif", "f64_vertical_feet.tif"] {
        is_made(name, &file(name, &HeightsOptions::default()).unwrap(), true, 1e-5);
    }
}

#[test]
fn pixels_without_data_are_found_in_masks_sparse_tiles_and_special_pixels() {
    let options = HeightsOptions::default();
    is_made("mask", &file("f32_mask.tif", &options).unwrap(), true, 0.0);
    // Only the first tile of 16 by 16 is stored; rasterio also masks the other 817 of 1073 nodes.
    let sparse = file("f32_sparse.tif", &options).unwrap();
    assert_eq!(sparse.heights.iter().filter(|h| h.is_nan()).count(), NX * NY - 256);
    assert_eq!(sparse.heights[(NY - 1) * NX + 7], made(7, 0));
    let isis = file("f32_isis.tif", &options).unwrap();
    for (k, h) in isis.heights.iter().enumerate() {
        let (i, r) = (k % NX, NY - 1 - k / NX);
        let special = r == 3 && (5..10).contains(&i);
        assert!(if special { h.is_nan() } else { *h == made(i, r) }, "{i} {r}: {h}");
    }
}

#[test]
fn heights_far_from_zero_keep_their_digits() {
    // At the radius of the Moon, the resolution of 32 bits is 12.5 cm.
    for name in ["f64_radius.tif", "i16_radius_offset.tif"] {
        let mut h = file(name, &HeightsOptions::default()).unwrap();
        // The first height in the file is 10 m below the radius of 1737400 m.
        assert_eq!(h.datum, 1_737_390.0, "{name}");
        h.heights.iter_mut().for_each(|h| *h -= 10.0);
        is_made(name, &h, true, 0.0);
    }
    let text = "ncols 2\nnrows 2\ncellsize 5\n1737400.25 1737400.5\n1737400.125 1737400\n";
    let h = alone("a.asc", text.as_bytes()).unwrap();
    assert_eq!((h.datum, h.heights), (1_737_400.0, vec![0.125, 0.0, 0.25, 0.5]));
    let points = alone("a.xyz", b"0 0 -20000.25\n1 0 -20000\n0 1 -20000.5\n1 1 -20001\n").unwrap();
    assert_eq!((points.datum, points.heights), (-20_000.0, vec![-0.25, 0.0, -0.5, -1.0]));
}

#[test]
fn the_southern_row_may_come_first() {
    let h = file("f32_from_south.tif", &HeightsOptions::default()).unwrap();
    is_made("from the south", &h, true, 0.0);
    assert_eq!((h.spacing, h.origin), ([2.5, 4.0], [1001.25, 1886.0]));
}

#[test]
fn nodes_that_are_degrees_apart_have_metres_from_the_ellipsoid() {
    let h = file("f32_degrees_mars.tif", &HeightsOptions::default()).unwrap();
    is_made("degrees", &h, true, 0.0);
    // Reference: pyproj 3.7.2, `Geod(a=3396190, rf=169.894447223612)`, 0.01 degrees of longitude at 18.45 degrees of
    // latitude, and 0.01 degrees of latitude around it.
    let wanted = [562.610_7, 586.824_2];
    assert!((0..2).all(|k| (h.spacing[k] - wanted[k]).abs() < 2e-3), "{:?}", h.spacing);
    // An ASCII grid with a spacing of arc seconds is rejected if it has no projection.
    let seconds = "ncols 2\nnrows 2\nxllcorner -118\nyllcorner 34\ncellsize 0.0002777\n1 2\n3 4\n";
    let told = alone("a.asc", seconds.as_bytes()).unwrap_err().to_string();
    assert!(told.contains("degrees apart"), "{told}");
}

/// Public reports: PotreeConverter #339, gdal PR 12057, gazebo-classic #2881.
#[test]
fn maps_whose_projection_stretches_distances_have_true_distances() {
    let h = file("f32_web_mercator.tif", &HeightsOptions::default()).unwrap();
    is_made("web mercator", &h, true, 0.0);
    // At y = 6 000 000 m GDAL's positions on WGS 84 have 13.573858 m and 13.532002 m for 20 m.
    let wanted = [2.5 * 13.573_858_3 / 20.0, 4.0 * 13.532_002_1 / 20.0];
    assert!((0..2).all(|k| (h.spacing[k] / wanted[k] - 1.0).abs() < 1e-4), "{:?}", h.spacing);
    assert_eq!(h.origin, [0.0, 0.0]);
    let h = file("f32_cylindrical_mars.tif", &HeightsOptions::default()).unwrap();
    // y = 2 999 944 m above the false northing is 50.611 degrees of latitude.
    let latitude = (4e6_f64 - 14.5 * 4.0 - 1e6) / 3_396_190.0;
    let wanted = [2.5 * latitude.cos() / 20_f64.to_radians().cos(), 4.0];
    assert!((0..2).all(|k| (h.spacing[k] / wanted[k] - 1.0).abs() < 1e-6), "{:?}", h.spacing);
    let forced = HeightsOptions { spacing: Some([2.0, 3.0]), ..HeightsOptions::default() };
    assert_eq!(file("f32_cylindrical_mars.tif", &forced).unwrap().spacing, [2.0, 3.0]);
    // The label of a PDS3 image with its radius in kilometres.
    let map = "MAP_PROJECTION_TYPE = \"EQUIRECTANGULAR\"\r\n A_AXIS_RADIUS = 1.7374 <KM>\r\n CENTER_LATITUDE = 20.0 <DEG>\r\n";
    let small = label("^IMAGE = 9", "UNSIGNED_INTEGER", 8, "")
        .replace("MAP_SCALE = 2.5", &format!("{map} MAP_SCALE = 0.01"));
    let mut bytes = small.into_bytes();
    bytes.resize(800, b' ');
    bytes.extend(vec![7; NX * NY]);
    let h = alone("a.img", &bytes).unwrap();
    // The middle line is 457.5 lines of 1 cm above the equator.
    let latitude = 4.575_f64 / 1737.4;
    let wanted = 0.01 * latitude.cos() / 20_f64.to_radians().cos();
    assert!((h.spacing[0] / wanted - 1.0).abs() < 1e-9 && h.spacing[1] == 0.01, "{:?}", h.spacing);
    // A `.prj` file with a cylindrical projection.
    let text = "ncols 2\nnrows 2\nxllcenter 0\nyllcenter 1819400\ncellsize 100\n1 2\n3 4\n";
    let prj = r#"PROJCS["Moon",GEOGCS["G",DATUM["D",SPHEROID["Moon",1737400,0]],UNIT["degree",0.0174532925]],PROJECTION["Equirectangular"],PARAMETER["Standard_Parallel_1",0],UNIT["metre",1]]"#;
    let mut beside = |name: &str| match name {
        "a.prj" => Ok(prj.as_bytes().to_vec()),
        other => Err(format!("there is no {other}")),
    };
    let options = HeightsOptions::default();
    let h = read_heights("a.asc", text.as_bytes(), &options, &mut beside).unwrap();
    let wanted = 100.0 * (1_819_450.0_f64 / 1_737_400.0).cos();
    assert!((h.spacing[0] / wanted - 1.0).abs() < 1e-9 && h.spacing[1] == 100.0, "{:?}", h.spacing);
}

#[test]
fn compressions_are_read_or_named_with_the_command_that_helps() {
    is_made("zstd", &file("f32_zstd.tif", &HeightsOptions::default()).unwrap(), true, 0.0);
    let told = file("f32_lerc.tif", &HeightsOptions::default()).unwrap_err().to_string();
    assert!(
        told.contains("LERC") && told.contains("gdal_translate -co COMPRESS=DEFLATE"),
        "{told}"
    );
}

#[test]
fn grids_and_points_as_text_are_the_same_heights() {
    let h = file("grid.asc", &HeightsOptions::default()).unwrap();
    is_made("grid.asc", &h, true, 0.0);
    assert_eq!((h.spacing, h.origin), ([2.5, 4.0], [1001.25, 1886.0]));
    // For the hole, GDAL writes the no-data value into the list of points, which does not declare
    // this value.
    let told = file("grid.xyz", &HeightsOptions::default()).unwrap_err().to_string();
    assert!(told.contains("-9999") && told.contains("leave the points out"), "{told}");
    let text = std::fs::read_to_string(data().join("grid.xyz")).unwrap();
    let without: String =
        text.lines().filter(|l| !l.contains("-9999")).map(|l| format!("{l}\n")).collect();
    let points = read_heights("p.xyz", without.as_bytes(), &HeightsOptions::default(), &mut |_| {
        Err("there is none".into())
    });
    let points = points.unwrap();
    is_made("grid.xyz", &points, true, 0.0);
    assert_eq!((points.spacing, points.origin), (h.spacing, h.origin));
}

#[test]
fn grey_pictures_go_from_black_to_white() {
    let options = HeightsOptions { spacing: Some([2.5, 4.0]), range: [-10.0, 53.75] };
    for name in ["grey8.bmp", "grey16.png"] {
        let h = file(name, &options).unwrap();
        is_made(name, &h, false, 4e-6);
        let told = file(name, &HeightsOptions::default()).unwrap_err().to_string();
        assert!(
            told.contains("does not have a scale") && told.contains("spacing: (0.1, 0.1)"),
            "{told}"
        );
    }
}

#[test]
fn labels_of_pds4_lead_to_their_data() {
    for name in ["pds4_i16.xml", "pds4_f32.xml"] {
        let h = file(name, &HeightsOptions::default()).unwrap();
        is_made(name, &h, true, 0.0);
        assert_eq!((h.spacing, h.origin), ([2.5, 4.0], [-499_000.0 + 1.25, 1886.0]), "{name}");
    }
    let label = std::fs::read_to_string(data().join("pds4_i16.xml")).unwrap();
    let with = |from: &str, to: &str| {
        let text = label.replace(from, to);
        assert_ne!(text, label, "{from}");
        read_heights("x.xml", text.as_bytes(), &HeightsOptions::default(), &mut |name| {
            std::fs::read(data().join(name)).map_err(|e| e.to_string())
        })
    };
    let south = with("Top to Bottom", "Bottom to Top").unwrap();
    assert_eq!(south.heights[7], made(7, 0));
    let km = with("<data_type>", "<unit>km</unit><data_type>").unwrap();
    assert_eq!(km.heights[7], 1000.0 * made(7, NY - 1));
    for (from, to, wanted) in [
        ("<data_type>SignedLSB2", "<data_type>ComplexLSB8", "elements of the type `ComplexLSB8`"),
        ("<elements>1<", "<elements>3<", "3 bands"),
        ("Last Index Fastest", "First Index Fastest", "First Index Fastest"),
        ("pds4_i16.img", "lost.img", "its data file `lost.img`"),
        ("<elements>29<", "<elements>290<", "cannot contain 37 by 290"),
        ("m/pixel", "deg/pixel", "a degree is not a length"),
        ("m/pixel", "ell/pixel", "`ell/pixel` is not a known unit"),
        ("<missing_constant>-32768", "<missing_constant>none", "`none` is not a sample"),
        ("Array_3D_Image", "Table_Binary", "0 arrays"),
    ] {
        let told = with(from, to).unwrap_err().to_string();
        assert!(told.contains(wanted), "{from} -> {to}: {told}");
    }
}

/// Returns a PDS3 label; `more` is in the object IMAGE.
fn label(pointer: &str, kind: &str, bits: u32, more: &str) -> String {
    format!(
        "PDS_VERSION_ID = PDS3\r\nRECORD_TYPE = FIXED_LENGTH\r\nRECORD_BYTES = 100\r\n{pointer}\r\n\
         DATA_SET_ID = \"A NAME (OF\r\n  TWO LINES\"\r\nOBJECT = IMAGE\r\n  LINES = {NY}\r\n  LINE_SAMPLES = {NX}\r\n\
         SAMPLE_TYPE = {kind}\r\n SAMPLE_BITS = {bits}\r\n {more}\r\nEND_OBJECT = IMAGE\r\n\
         OBJECT = IMAGE_MAP_PROJECTION\r\n MAP_SCALE = 2.5 <M/PIXEL>\r\n\
         LINE_PROJECTION_OFFSET = 471.5 <PIXEL>\r\n SAMPLE_PROJECTION_OFFSET = -400.5 <PIXEL>\r\n\
         END_OBJECT = IMAGE_MAP_PROJECTION\r\nEND\r\n"
    )
}

/// The samples s of [`made`], h = 0.25 s - 10, with -32768 at the hole, in each type.
fn samples(one: impl Fn(f64) -> Vec<u8>, hole: &[u8]) -> Vec<u8> {
    let of = |k: usize| match (k % NX, k / NX) {
        (5, 3) => hole.to_vec(),
        (i, r) => one(f64::from(made(i, r) + 10.0) * 4.0),
    };
    (0..NX * NY).flat_map(of).collect()
}

#[test]
fn images_of_pds3_have_their_heights_in_every_type() {
    let scale = "SCALING_FACTOR = 0.25\r\n OFFSET = -10.0\r\n";
    let cases: [(&str, u32, Vec<u8>, &str); 9] = [
        (
            "MSB_INTEGER",
            16,
            samples(|s| (s as i16).to_be_bytes().to_vec(), &(-32768i16).to_be_bytes()),
            "-32768",
        ),
        (
            "LSB_INTEGER",
            16,
            samples(|s| (s as i16).to_le_bytes().to_vec(), &(-32768i16).to_le_bytes()),
            "-32768",
        ),
        (
            "MSB_UNSIGNED_INTEGER",
            16,
            samples(|s| (s as u16).to_be_bytes().to_vec(), &[0xff, 0xff]),
            "65535",
        ),
        (
            "LSB_UNSIGNED_INTEGER",
            32,
            samples(|s| (s as u32).to_le_bytes().to_vec(), &[0xff; 4]),
            "16#FFFFFFFF#",
        ),
        ("UNSIGNED_INTEGER", 8, samples(|s| vec![s as u8], &[255]), "255"),
        (
            "SUN_INTEGER",
            32,
            samples(|s| (s as i32).to_be_bytes().to_vec(), &(-1i32).to_be_bytes()),
            "-1",
        ),
        (
            "IEEE_REAL",
            32,
            samples(|s| (s as f32).to_be_bytes().to_vec(), &[0xff, 0x7f, 0xff, 0xfb]),
            "16#FF7FFFFB#",
        ),
        (
            "PC_REAL",
            32,
            samples(|s| (s as f32).to_le_bytes().to_vec(), &[0xfb, 0xff, 0x7f, 0xff]),
            "-3.40282265508890445e+38",
        ),
        (
            "IEEE_REAL",
            64,
            samples(|s| s.to_be_bytes().to_vec(), &f64::MIN.to_be_bytes()),
            "-1.7976931348623157e+308",
        ),
    ];
    for (kind, bits, bytes, missing) in cases {
        let more = format!("{scale} MISSING_CONSTANT = {missing}");
        // Test a detached label with the name in capitals, and images attached by record, by byte, and in another
        // record of a file.
        let detached = label("^IMAGE = \"DATA.IMG\"", kind, bits, &more);
        let mut asked = String::new();
        let h =
            read_heights("x.lbl", detached.as_bytes(), &HeightsOptions::default(), &mut |name| {
                asked = name.to_string();
                (name == "data.img").then(|| bytes.clone()).ok_or_else(|| "there is none".into())
            });
        let h = h.unwrap_or_else(|e| panic!("{kind} {bits}: {e}"));
        is_made(kind, &h, true, 0.0);
        assert_eq!((h.spacing, asked.as_str()), ([2.5, 2.5], "data.img"));
        // GDAL puts the corner of the first pixel of such a label at x = 1000, y = 1180.
        assert_eq!(h.origin, [1001.25, 1178.75 - 28.0 * 2.5]);
        for (pointer, start) in [("^IMAGE = 13", 1200), ("^IMAGE = 1021 <BYTES>", 1020)] {
            let mut image = label(pointer, kind, bits, &more).into_bytes();
            assert!(image.len() <= start);
            image.resize(start, b' ');
            image.extend(&bytes);
            is_made(kind, &alone("x.img", &image).unwrap(), true, 0.0);
        }
        let second = label("^IMAGE = (\"DATA.IMG\", 3)", kind, bits, &more);
        let shifted = [vec![7; 200], bytes.clone()].concat();
        let h = read("x.lbl", second.as_bytes(), &shifted).unwrap();
        is_made(kind, &h, true, 0.0);
        // If the file name is the name of the image, its label is in the same folder.
        let whole = label("^IMAGE = \"X.IMG\"", kind, bits, &more);
        is_made(kind, &read("x.img", &bytes, whole.as_bytes()).unwrap(), true, 0.0);
    }
}

#[test]
fn labels_of_pds3_are_refused_with_the_line_and_the_remedy() {
    let bytes = samples(|s| (s as i16).to_be_bytes().to_vec(), &[0; 2]);
    let fine = label("^IMAGE = \"A.IMG\"", "MSB_INTEGER", 16, "BANDS = 1");
    assert!(read("a.lbl", fine.as_bytes(), &bytes).is_ok());
    for (from, to, wanted) in [
        (
            "MSB_INTEGER",
            "VAX_REAL",
            "line 10: samples of 16 bits of the type VAX_REAL are not supported",
        ),
        ("BANDS = 1", "BANDS = 3", "3 bands"),
        ("BANDS = 1", "ENCODING_TYPE = HUFFMAN", "the encoding HUFFMAN is not supported"),
        ("BANDS = 1", "UNIT = FURLONG", "`FURLONG` is not a known unit"),
        ("BANDS = 1", "OFFSET = much", "`much` is not a valid number for OFFSET"),
        ("BANDS = 1", "NOTE = \"open", "does not end"),
        ("LINES = 29", "LINES = 30", "cannot contain 37 by 30"),
        ("LINES = 29", "LINES = 1e15", "are too many"),
        ("LINES = 29", "LINES = -1", "-1 is not a valid number for LINES"),
        (
            "MAP_SCALE = 2.5 <M/PIXEL>",
            "MAP_RESOLUTION = 4 <PIXEL/DEGREE>",
            "0.25 by 0.25 degrees apart",
        ),
        ("MAP_SCALE = 2.5 <M/PIXEL>", "", "the label does not have a scale"),
        ("MAP_SCALE = 2.5 ", "MAP_SCALE = 0 ", "the distance between nodes is 0"),
        ("^IMAGE", "^TABLE", "the label lacks ^IMAGE"),
        ("\"A.IMG\"", "(\"A.IMG\", 0)", "positions begin at 1"),
        ("\"A.IMG\"", "(\"A.IMG\", 99999999999999)", "cannot contain"),
        ("\r\nEND\r\n", "\r\n", "the label lacks END"),
    ] {
        let text = fine.replace(from, to);
        assert_ne!(text, fine, "{from}");
        let told = read("a.lbl", text.as_bytes(), &bytes).unwrap_err().to_string();
        assert!(told.contains(wanted), "{from} -> {to}: {told}");
    }
    let told = alone("a.img", &bytes).unwrap_err().to_string();
    assert!(told.contains("`a.lbl` in its folder"), "{told}");
}

#[test]
fn degrees_bands_and_turned_rows_are_refused_with_the_remedy() {
    let none = HeightsOptions::default();
    let told = file("f32_degrees.tif", &none).unwrap_err().to_string();
    assert!(told.contains("2.5 by 4 degrees apart") && told.contains("gdalwarp -t_srs"), "{told}");
    let metres = HeightsOptions { spacing: Some([30.0, 20.0]), ..none.clone() };
    assert_eq!(file("f32_degrees.tif", &metres).unwrap().spacing, [30.0, 20.0]);
    for name in ["two_bands.tif", "two_planes.tif"] {
        let told = file(name, &none).unwrap_err().to_string();
        assert!(told.contains("2 bands"), "{told}");
    }
    let turned = raster::Tiff {
        matrix: Some([2.0, 0.1, 0.0, 5.0, 0.1, -2.0, 0.0, 7.0]),
        ..raster::Tiff::of(3, 2)
    };
    let told = alone("a.tif", &turned.bytes(&[1.0; 6])).unwrap_err().to_string();
    assert!(told.contains("rotated"), "{told}");
    let straight = raster::Tiff {
        matrix: Some([2.0, 0.0, 0.0, 5.0, 0.0, -3.0, 0.0, 7.0]),
        ..raster::Tiff::of(3, 2)
    };
    let h = alone("a.tif", &straight.bytes(&[1.0; 6])).unwrap();
    assert_eq!((h.spacing, h.origin), ([2.0, 3.0], [6.0, 7.0 - 4.5]));
    let nothing = raster::Tiff { scale: None, ..raster::Tiff::of(3, 2) };
    let told = alone("a.tif", &nothing.bytes(&[1.0; 6])).unwrap_err().to_string();
    assert!(told.contains("not have a scale"), "{told}");
    let degrees = "GEOGCS[\"GCS\",UNIT[\"Degree\",0.0174532925199433]]";
    let grid = std::fs::read(data().join("grid.asc")).unwrap();
    let told = read("grid.asc", &grid, degrees.as_bytes()).unwrap_err().to_string();
    assert!(told.contains("2.5 by 4 degrees"), "{told}");
}

#[test]
fn texts_are_refused_with_their_line() {
    let asc = "ncols 3\nnrows 2\ncellsize 5\n1 2 3\n4 5 6\n";
    assert_eq!(value(&alone("a.asc", asc.as_bytes()).unwrap(), 0, 0), 4.0);
    for (from, to, wanted) in [
        ("nrows 2", "nrows 3", "it ends after 6 heights of 3 by 3"),
        ("nrows 2", "nrows 1e9", "too many"),
        ("nrows 2", "", "nrows: it is missing"),
        ("nrows 2", "nrows two", "line 2: `two` is not a number"),
        ("nrows 2", "nrows 2\nnrows 2", "line 3: `nrows` is written twice"),
        ("nrows 2", "nlines 2", "line 2: `nlines` is not an entry of the header"),
        ("cellsize 5", "cellsize -5", "the distance between nodes is -5"),
        ("cellsize 5", "", "does not have a scale"),
        ("4 5 6", "4 5 6 7", "line 5: there are more heights than 3 by 2"),
        ("4 5 6", "4 x 6", "line 5: `x` is not a height"),
        ("4 5 6", "4 inf 6", "column 1, row 1 is infinite"),
        ("4 5 6", "4 1e39 6", "column 1, row 1 is infinite"),
    ] {
        let told = alone("a.asc", asc.replace(from, to).as_bytes()).unwrap_err().to_string();
        assert!(told.contains(wanted), "{from} -> {to}: {told}");
    }
    // The points are in any order, with a hole, names of columns, comments and commas.
    let xyz = "x,y,z\n# a note\n10,0,4\n0,5,1\n10,5,3\n0,0,2\n20,0,5\n";
    let h = alone("a.xyz", xyz.as_bytes()).unwrap();
    assert_eq!((h.nx, h.ny, h.spacing), (3, 2, [10.0, 5.0]));
    assert_eq!(&h.heights[..5], [2.0, 4.0, 5.0, 1.0, 3.0]);
    assert!(h.heights[5].is_nan());
    for (from, to, wanted) in [
        ("10,5,3", "13,5,3", "is not at a node"),
        ("10,5,3", "0,5,3", "line 5: line 4 has another height for the same node"),
        ("10,5,3", "10,5", "line 5: it is not a point"),
        ("10,5,3", "10,5,3,1", "line 5: it is not a point"),
        ("10,5,3", "1e9,5,3", "nodes"),
        ("0,5,1\n10,5,3\n", "", "all points have the same y"),
    ] {
        let told = alone("a.xyz", xyz.replace(from, to).as_bytes()).unwrap_err().to_string();
        assert!(told.contains(wanted), "{from} -> {to}: {told}");
    }
    // Spreadsheet programs write a byte order mark, semicolons and decimal commas.
    let european = "\u{feff}x;y;z\n0,5;0;2,25\n10,5;0;4\n0,5;5;1\n10,5;5;3\n";
    let h = alone("a.xyz", european.as_bytes()).unwrap();
    assert_eq!((h.nx, h.ny, h.spacing, h.origin), (2, 2, [10.0, 5.0], [0.5, 0.0]));
    assert_eq!(h.heights, [2.25, 4.0, 1.0, 3.0]);
    let rows = format!("{european};;\r\n;;\r\n");
    assert_eq!(alone("a.xyz", rows.as_bytes()).unwrap().heights, h.heights);
    let wide: Vec<u8> = rows.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let told = alone("a.xyz", &wide).unwrap_err().to_string();
    assert!(told.contains("UTF-16") && told.contains("save it as UTF-8"), "{told}");
    let told = alone("a.xyz", european.replace("2,25", "2,2,5").as_bytes()).unwrap_err();
    assert!(told.to_string().contains("line 2: it is not a point"), "{told}");
    let marked = format!("\u{feff}{}", "ncols 2\nnrows 2\ncellsize 5\n1 2\n3 4\n");
    assert_eq!(alone("a.asc", marked.as_bytes()).unwrap().heights, [3.0, 4.0, 1.0, 2.0]);
    // A few points far apart are not a grid of millions of nodes.
    let told = alone("a.xyz", b"0 0 1\n1 0 1\n5000 5000 1\n0 1 1\n").unwrap_err().to_string();
    assert!(told.contains("cannot contain 5001 by 5001"), "{told}");
    let told = alone("a.ply", b"").unwrap_err().to_string();
    assert!(told.contains("`a.ply`") && told.contains(".asc"), "{told}");
}

#[test]
fn published_files_are_read() {
    let none = HeightsOptions::default();
    let range = |h: &Heights| {
        h.heights.iter().fold((f32::MAX, f32::MIN), |(a, b), &v| (a.min(v), b.max(v)))
    };
    if let Some(bytes) = reference("gzcommon_dem_moon.tif") {
        let h = alone("moon.tif", &bytes).unwrap();
        assert_eq!((h.nx, h.ny), (33, 33));
        assert!((h.spacing[0] - 2.4266).abs() < 1e-3 && (h.spacing[1] - 2.4266).abs() < 1e-3);
        let (low, high) = range(&h);
        assert!((low + 212.296).abs() < 1e-3 && (high + 205.440).abs() < 1e-3, "{low} {high}");
    }
    if let Some(bytes) = reference("gzcommon_dem_landscape.tif") {
        // The file is in degrees of NAD83. 0.005 and 0.008 degrees at 37.5 degrees of latitude were converted
        // to metres by pyproj 3.7.2.
        let h = alone("landscape.tif", &bytes).unwrap();
        let wanted = [443.601, 890.856];
        assert!((0..2).all(|k| (h.spacing[k] - wanted[k]).abs() < 2e-3), "{:?}", h.spacing);
        let metres = HeightsOptions { spacing: Some([30.0, 20.0]), ..none.clone() };
        let h = read_heights("l.tif", &bytes, &metres, &mut |_| Err(String::new())).unwrap();
        assert!(h.nx * h.ny == 125 * 200 && h.nx > h.ny && h.spacing == [30.0, 20.0]);
    }
    let grey = HeightsOptions { spacing: Some([1.0, 1.0]), range: [0.0, 65535.0] };
    if let Some(bytes) = reference("gzcommon_grayscale_16bit.png") {
        let h = read_heights("a.png", &bytes, &grey, &mut |_| Err(String::new())).unwrap();
        assert_eq!((h.nx, h.ny), (4, 4));
        // A grey value that is not a multiple of 257 cannot come from 8 bits.
        assert!(h.heights.iter().any(|h| (h / 257.0).fract() != 0.0), "{:?}", h.heights);
    }
    if let Some(bytes) = reference("bump64.bmp") {
        let grey = HeightsOptions { range: [0.0, 255.0], ..grey };
        let h = read_heights("bump.bmp", &bytes, &grey, &mut |_| Err(String::new())).unwrap();
        assert_eq!((h.nx, h.ny), (64, 64));
        // Rows are counted from the north, as in GDAL.
        assert_eq!(h.heights.iter().sum::<f32>(), 217_104.0);
        for (i, row, grey) in [(20, 10, 42.0), (10, 20, 22.0), (33, 40, 171.0), (33, 28, 245.0)] {
            assert_eq!(value(&h, i, 63 - row), grey, "{i} {row}");
        }
    }
}

/// An ASCII grid of 3 by 2 nodes.
fn grid(header: &str, heights: &str) -> Result<Heights, HeightsError> {
    let text = format!("ncols 3\nnrows 2\n{header}\n{heights}\n");
    linkwork_formats::heights::read_heights(
        "case.asc",
        text.as_bytes(),
        &HeightsOptions::default(),
        &mut |_| Err("there is none".into()),
    )
}

/// Public reports: gemgis #220 (the corner before the cell size), AvaFrame #425 (`dx` and `dy`), Leaflet.CanvasLayer.Field #17 (`xllcenter`),
/// landlab PR 60 (the northern row first), gdal #9666 (a grid that begins with `nan`).
#[test]
fn headers_of_ascii_grids_are_read_in_every_form() {
    let heights = "1 2 3\n4 5 6";
    let own = |h: &Heights| (h.spacing, h.origin, h.heights.clone());
    let want = ([10.0, 10.0], [105.0, 205.0], vec![4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
    for header in [
        "xllcorner 100\nyllcorner 200\ncellsize 10",
        "cellsize 10\nXLLCENTER 105\nYLLCENTER 205\nNODATA_value -9999",
        "dx 10\ndy 10\nyllcorner 200\nxllcorner 100",
    ] {
        assert_eq!(own(&grid(header, heights).unwrap()), want, "{header}");
    }
    let holes = grid("cellsize 10", "nan nan 3\nNaN 5 6").unwrap();
    let gone: Vec<bool> = holes.heights.iter().map(|h| h.is_nan()).collect();
    assert_eq!(gone, [true, false, false, true, true, false]);
}

/// topodroid #175: a mark of missing data that differs from the declared one in its last digits; and marks that nobody declared.
#[test]
fn undeclared_marks_of_missing_data_are_not_heights() {
    let told = |header: &str, heights: &str| grid(header, heights).map_err(|e| e.to_string());
    let float = "cellsize 10\nNODATA_value -3.4028230607370965251e+38";
    let message = told(float, "1 2 -3.40282e38\n4 5 6").unwrap_err();
    assert!(message.contains("more than 100 km apart"), "{message}");
    let message = told("cellsize 10", "1 2 -9999\n-9999 5 6").unwrap_err();
    assert!(
        message.contains("the height -9999 m, a usual mark of missing data, occurs 2 times"),
        "{message}"
    );
    assert!(message.contains("lowest other height is 1.0 m"), "{message}");
    let message = told("cellsize 10", "-32768 1830 1840\n1850 1860 1870").unwrap_err();
    assert!(message.contains("-32768 m, a usual mark"), "{message}");
    // A deep basin and declared holes are not suspicious.
    told("cellsize 10", "-9999 -9990 -9980\n-8000 -7000 -6000").unwrap();
    told("cellsize 10\nnodata_value -9999", "1 2 -9999\n-9999 5 6").unwrap();
    // Radii of the Moon are stored relative to a datum.
    told("cellsize 10", "1737400 1737401 1737402\n1738000 1736000 1737000").unwrap();
}

/// The decoder of the crate `tiff` rejects one of its tiles (`heights/geotiff/lzw.rs`); GDAL wrote the file and reads it.
#[test]
fn tiles_that_end_where_the_width_of_codes_changes_are_read() {
    let h = file("i16_tiles_lzw_end.tif", &HeightsOptions::default()).unwrap();
    for (k, height) in h.heights.iter().enumerate() {
        let (i, r) = (k % NX, NY - 1 - k / NX);
        assert_eq!(*height, ((66 * i * i + 31 * r * r + 14 * i * r) % 997) as f32, "{i}, {r}");
    }
    // A truncated tile is still an error, which states both sizes.
    let mut bytes = std::fs::read(data().join("i16_tiles_lzw_end.tif")).unwrap();
    let size = bytes.len();
    bytes.truncate(size - 40);
    let told = read_heights("cut.tif", &bytes, &HeightsOptions::default(), &mut |_| {
        Err("there is none".into())
    });
    assert!(told.is_err_and(|e| e.to_string().contains("of 512 bytes")));
}
