//! Height files with wrong sizes, truncated and damaged files: they are rejected or read without a panic, and without allocating the memory that a
//! header claims.
#![allow(clippy::unwrap_used)]
use linkwork_formats::heights::{Heights, HeightsError, HeightsOptions, read_heights};

#[path = "../../../tests/fuzz/mutate.rs"]
mod mutate;
#[path = "support/raster.rs"]
mod raster;
use raster::{Tiff, alone, bmp, png, png_of};

/// The memory is that of the process: tests that measure it run one after another.
static ALONE: std::sync::Mutex<()> = std::sync::Mutex::new(());

fn by_itself() -> std::sync::MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

const GREY: HeightsOptions = HeightsOptions { spacing: Some([1.0, 2.0]), range: [-1.0, 4.0] };

fn grey(name: &str, bytes: &[u8]) -> Result<Heights, HeightsError> {
    read_heights(name, bytes, &GREY, &mut |_| Err("there is none".into()))
}

#[test]
fn a_file_that_says_more_than_it_holds_takes_no_memory() {
    let _alone = by_itself();
    let before = mutate::most_memory();
    for (nx, ny) in [(60_000, 60_000), (0x7fff_ffff, 0x7fff_ffff), (8001, 8000)] {
        let told = grey("a.png", &png_of(nx, ny)).unwrap_err();
        assert!(matches!(told, HeightsError::TooMany { .. }), "{told}");
        assert!(told.to_string().contains("linkwork terrain convert"));
        let told = grey("a.tif", &Tiff::of(nx, ny).bytes(&[])).unwrap_err();
        assert!(matches!(told, HeightsError::Short { .. }), "{told}");
    }
    let told = grey("a.png", &png_of(5000, 5000)).unwrap_err();
    assert!(matches!(told, HeightsError::Short { .. }), "{told}");
    let told = grey("a.bmp", &bmp(60_000, 60_000, 8, &[], &[])).unwrap_err();
    assert!(matches!(told, HeightsError::TooMany { .. }), "{told}");
    let told = grey("a.bmp", &bmp(2000, i32::MIN, 32, &[], &[])).unwrap_err();
    assert!(matches!(told, HeightsError::TooMany { .. }), "{told}");
    let told = grey("a.bmp", &bmp(100, 100, 8, &[], &[0; 9999])).unwrap_err();
    assert!(matches!(told, HeightsError::Short { .. }), "{told}");
    // The decoder rejects files that are only slightly too short.
    assert!(grey("a.png", &png_of(50, 50)).is_err());
    assert!(grey("a.tif", &Tiff::of(50, 50).bytes(&[1.0; 2499])).is_err());
    assert!(grey("a.tif", &Tiff::of(50, 50).bytes(&[1.0; 2500])).is_ok());
    if let (Some(before), Some(after)) = (before, mutate::most_memory()) {
        assert!(after.saturating_sub(before) < 16 << 20, "{before} {after}");
    }
}

/// A deflate bomb: 400 MB of zeros in 400 kB, which claims to be a small image, and a large one.
#[test]
fn a_bomb_is_unpacked_as_far_as_its_picture_goes() {
    let _alone = by_itself();
    use std::io::Write;
    let mut pack = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    for _ in 0..400 {
        pack.write_all(&vec![0; 1 << 20]).unwrap();
    }
    let packed = pack.finish().unwrap();
    let file = |width: u32, height: u32| {
        let mut bytes = Tiff::of(width, height).bytes(&[]);
        // The tag of the compression (259) is the fourth of the directory, which starts at byte 8. The offset and the
        // length of the strip are the sixth and the ninth.
        let entry = |k: usize| 8 + 2 + 12 * k + 8;
        let start = bytes.len() as u32;
        bytes[entry(3)..entry(3) + 4].copy_from_slice(&8u32.to_le_bytes());
        bytes[entry(5)..entry(5) + 4].copy_from_slice(&start.to_le_bytes());
        bytes[entry(8)..entry(8) + 4].copy_from_slice(&(packed.len() as u32).to_le_bytes());
        bytes.extend(&packed);
        bytes
    };
    let before = mutate::most_memory();
    let small = grey("a.tif", &file(10, 10)).unwrap();
    assert_eq!(small.heights, [0.0; 100]);
    let told = grey("a.tif", &file(40_000, 10_000)).unwrap_err();
    assert!(matches!(told, HeightsError::TooMany { .. }), "{told}");
    if let (Some(before), Some(after)) = (before, mutate::most_memory()) {
        assert!(after.saturating_sub(before) < 32 << 20, "{before} {after}");
    }
}

#[test]
fn pictures_that_are_not_grey_are_refused_and_transparent_pixels_are_holes() {
    use png::ColorType::{GrayscaleAlpha, Rgb};
    let same = grey("a.png", &png(2, 2, Rgb, &[0, 0, 0, 255, 255, 255, 51, 51, 51, 102, 102, 102]));
    assert_eq!(same.unwrap().heights, [0.0, 1.0, -1.0, 4.0]);
    let told = grey("a.png", &png(2, 2, Rgb, &[0, 0, 0, 255, 255, 255, 51, 51, 51, 9, 102, 102]));
    assert!(told.unwrap_err().to_string().contains("colours (column 1, row 1)"));
    let holes =
        grey("a.png", &png(2, 2, GrayscaleAlpha, &[0, 255, 9, 0, 51, 255, 102, 255])).unwrap();
    assert!(holes.heights[3].is_nan() && holes.heights[0] == 0.0);
    let told = grey("a.png", &png(2, 2, GrayscaleAlpha, &[0, 255, 9, 7, 51, 255, 102, 255]));
    assert!(told.unwrap_err().to_string().contains("half-transparent"));

    let two = [[0, 0, 0, 0], [255, 255, 255, 0]];
    // The image has one bit per pixel, and the lower line comes first: 0 1 / 1 0.
    let bits = bmp(2, 2, 1, &two, &[0b0100_0000, 0, 0, 0, 0b1000_0000, 0, 0, 0]);
    assert_eq!(grey("a.bmp", &bits).unwrap().heights, [-1.0, 4.0, 4.0, -1.0]);
    let top = bmp(2, -2, 1, &two, &[0b0100_0000, 0, 0, 0, 0b1000_0000, 0, 0, 0]);
    assert_eq!(grey("a.bmp", &top).unwrap().heights, [4.0, -1.0, -1.0, 4.0]);
    let four = bmp(3, 2, 4, &two, &[0x01, 0x10, 0, 0, 0x10, 0x00, 0, 0]);
    assert_eq!(grey("a.bmp", &four).unwrap().heights, [-1.0, 4.0, 4.0, 4.0, -1.0, -1.0]);
    let full = bmp(2, 2, 24, &[], &[0, 0, 0, 255, 255, 255, 0, 0, 51, 51, 51, 102, 102, 102, 0, 0]);
    assert_eq!(grey("a.bmp", &full).unwrap().heights, [-1.0, 4.0, 0.0, 1.0]);
    let colour = bmp(2, 2, 24, &[], &[0, 0, 0, 255, 255, 255, 0, 0, 51, 51, 51, 102, 9, 102, 0, 0]);
    let told = grey("a.bmp", &colour).unwrap_err().to_string();
    assert!(told.contains("colours (column 1, row 0)"), "{told}");
    // This palette has too few entries.
    let short = bmp(2, 2, 8, &two, &[0, 1, 0, 0, 2, 0, 0, 0]);
    assert!(grey("a.bmp", &short).unwrap_err().to_string().contains("truncated"));
    let mut packed = bits.clone();
    packed[30] = 1;
    assert!(grey("a.bmp", &packed).unwrap_err().to_string().contains("compressed"));
    assert!(grey("a.bmp", b"hello").unwrap_err().to_string().contains("not a readable BMP"));
    assert!(grey("a.png", b"hello").unwrap_err().to_string().contains("not a readable PNG"));
    assert!(grey("a.tif", b"hello").unwrap_err().to_string().contains("not a readable TIFF"));
}

#[test]
fn missing_cells_are_found_even_when_their_text_is_not_an_f32() {
    for text in ["-3.4028234663852886e+38", "-3.40282346600000016e+38", "-9999", "nan"] {
        let hole = match text {
            "-9999" => -9999.0,
            "nan" => f32::NAN,
            _ => f32::MIN,
        };
        let tie = Some([0.0, 0.0, 0.0, 100.0, 50.0, 0.0]);
        let file = Tiff { tie, missing: Some(text.into()), ..Tiff::of(3, 2) };
        let h = alone("a.tif", &file.bytes(&[1.0, 2.0, 3.0, 4.0, hole, 6.0])).unwrap();
        assert_eq!(h.heights.iter().filter(|h| h.is_nan()).count(), 1, "{text}");
        assert!(h.heights[1].is_nan(), "the southern row comes first");
        assert_eq!((h.heights[0], h.heights[3]), (4.0, 1.0));
        assert_eq!((h.origin, h.spacing), ([101.0, 42.5], [2.0, 5.0]));
    }
    let file = Tiff { missing: Some("none".into()), ..Tiff::of(3, 2) };
    let told = alone("a.tif", &file.bytes(&[1.0; 6])).unwrap_err().to_string();
    assert!(told.contains("`none` is not a number"), "{told}");
}

/// Returns the files written by GDAL, with their extension.
fn seeds(ending: &str) -> Vec<Vec<u8>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/heights");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    files.sort();
    let of_kind = files.iter().filter(|f| f.extension().is_some_and(|e| e == ending));
    of_kind.map(|f| std::fs::read(f).unwrap()).collect()
}

#[test]
fn mutations_are_read_or_refused() {
    let _alone = by_itself();
    let text = |kind: &str| {
        format!(
            "PDS_VERSION_ID = PDS3\nRECORD_BYTES = 100\n^IMAGE = 4\nOBJECT = IMAGE\nLINES = 4\nLINE_SAMPLES = 5\n\
             SAMPLE_TYPE = {kind}\nSAMPLE_BITS = 16\nMISSING = 16#0102#\nEND_OBJECT\nMAP_SCALE = 1 <KM/PIXEL>\nEND\n"
        )
    };
    let image = |kind: &str| {
        let mut bytes = text(kind).into_bytes();
        bytes.resize(340, 7);
        bytes
    };
    for (name, all, count) in [
        ("a.tif", seeds("tif"), 6000),
        ("a.png", seeds("png"), 1000),
        ("a.bmp", seeds("bmp"), 2000),
        ("a.asc", seeds("asc"), 1500),
        ("a.xyz", seeds("xyz"), 1000),
        ("a.xml", seeds("xml"), 1500),
        ("a.img", vec![image("MSB_INTEGER"), image("PC_REAL")], 3000),
    ] {
        assert!(!all.is_empty(), "{name}");
        let beside = vec![0; 4292];
        print!("{name}: ");
        mutate::survives(&all, count, |bytes| {
            let read = read_heights(name, bytes, &GREY, &mut |_| Ok(beside.clone()));
            match read {
                Ok(h) => {
                    assert_eq!(h.heights.len(), h.nx * h.ny);
                    true
                }
                Err(e) => {
                    assert!(!e.to_string().is_empty());
                    false
                }
            }
        });
    }
}
