//! Written files read back, digit for digit.
use linkwork_formats::heights::{
    GeoTiff, Heights, HeightsOptions, Map, read_heights, write_ascii, write_geotiff, write_png,
};
use std::io::Cursor;

use crate::raster;

/// Heights without a pattern, with holes.
fn heights(nx: usize, ny: usize) -> Heights {
    let one = |k: usize| match k % 101 {
        7 => f32::NAN,
        _ => ((k as f32) * 0.37).sin() * 1e3 + (k as f32) * 1e-3,
    };
    let heights = (0..nx * ny).map(one).collect();
    Heights { nx, ny, heights, datum: 0.0, spacing: [0.5, 0.25], origin: [-3.0, 1e5 + 0.125] }
}

fn write(
    h: &Heights,
    with: impl FnOnce(&mut Cursor<Vec<u8>>, &mut Map<'_>) -> std::io::Result<()>,
) -> Vec<u8> {
    let mut row = |j: usize, row: &mut [f32]| {
        row.copy_from_slice(&h.heights[j * h.nx..(j + 1) * h.nx]);
        Ok(())
    };
    let (size, spacing, origin) = ([h.nx, h.ny], h.spacing, h.origin);
    let mut map = Map { size, spacing, origin, datum: h.datum, row: &mut row };
    let mut out = Cursor::new(Vec::new());
    with(&mut out, &mut map).unwrap();
    out.into_inner()
}

fn same(a: &Heights, b: &Heights) {
    assert_eq!((a.nx, a.ny, a.datum), (b.nx, b.ny, b.datum));
    assert_eq!((a.spacing, a.origin), (b.spacing, b.origin));
    let bits = |h: &Heights| -> Vec<u32> {
        h.heights.iter().map(|h| if h.is_nan() { 0x7fc0_0000 } else { h.to_bits() }).collect()
    };
    assert_eq!(bits(a), bits(b));
}

#[test]
fn geotiff_and_ascii_come_back_digit_for_digit() {
    for (nx, ny) in [(300, 270), (2, 3), (256, 512), (257, 2)] {
        let h = heights(nx, ny);
        let tif = write(&h, write_geotiff);
        same(&raster::alone("a.tif", &tif).unwrap(), &h);
        let asc = write(&h, write_ascii);
        same(&raster::alone("a.asc", &asc).unwrap(), &h);
    }
    // Heights far from zero are stored relative to a datum.
    let mut h = heights(20, 30);
    h.heights[29 * 20] = 0.25;
    h.datum = 1_737_400.0;
    same(&raster::alone("a.tif", &write(&h, write_geotiff)).unwrap(), &h);
    let asc = raster::alone("a.asc", &write(&h, write_ascii)).unwrap();
    assert_eq!(asc.datum, h.datum);
    assert!(asc.heights.iter().zip(&h.heights).all(|(a, b)| (a - b).abs() < 1e-9 || b.is_nan()));
    // Rows can be read one by one in any order.
    let h = heights(300, 600);
    let tif = write(&h, write_geotiff);
    let mut open =
        GeoTiff::open(Cursor::new(&tif), tif.len() as u64, &HeightsOptions::default()).unwrap();
    let mut row = vec![0.0; 300];
    for j in [0, 599, 300, 17, 343, 344, 88] {
        open.row(j, &mut row).unwrap();
        let want = &h.heights[j * 300..(j + 1) * 300];
        assert!(row.iter().zip(want).all(|(a, b)| a == b || (a.is_nan() && b.is_nan())), "row {j}");
    }
    assert!(open.row(600, &mut row).is_err() && open.row(0, &mut row[..299]).is_err());
}

#[test]
fn a_png_is_as_fine_as_its_grey_values() {
    let mut h = heights(40, 30);
    let range = [-1100.0, 1100.0];
    let options = HeightsOptions { spacing: Some(h.spacing), range: range.map(f64::from) };
    for holes in [true, false] {
        if !holes {
            h.heights.iter_mut().for_each(|v| *v = if v.is_nan() { 0.0 } else { *v });
        }
        let png = write(&h, |out, map| write_png(out, map, range));
        let read = read_heights("a.png", &png, &options, &mut |_| Err(String::new())).unwrap();
        for (a, b) in read.heights.iter().zip(&h.heights) {
            assert_eq!(a.is_nan(), b.is_nan());
            assert!(a.is_nan() || (a - b).abs() <= 0.5001 * 2200.0 / 65535.0, "{a} {b}");
        }
    }
}
