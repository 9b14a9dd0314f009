//! Files of tiles from outside: damaged ones, and one of 40 GB of heights that is written here byte by byte.
#![allow(clippy::unwrap_used)]
use linkwork_environment::height_field::HeightField;
use linkwork_environment::tiles::{Tiles, write_tiles};
use std::collections::BTreeMap;
use std::io::{Seek, SeekFrom, Write};

#[path = "../../../tests/fuzz/mutate.rs"]
mod mutate;

/// Memory is that of the process: tests that look at it go one after another.
static ALONE: std::sync::Mutex<()> = std::sync::Mutex::new(());

#[test]
fn mutations_are_read_or_told() {
    let _alone = ALONE.lock().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (nx, ny) = (40, 37);
    let height = |k: usize| if k % 97 == 5 { f32::NAN } else { (k as f32 * 0.7).sin() };
    let heights = (0..nx * ny).map(height).collect();
    let field = HeightField::new([-7.25, 11.5], [0.5, 0.75], nx, ny, heights).unwrap();
    let path = folder.path().join("m.tiles");
    write_tiles(&path, &mut &field, 16).unwrap();
    let seed = std::fs::read(&path).unwrap();
    mutate::survives(&[seed], 1500, |bytes| {
        std::fs::write(&path, bytes).unwrap();
        let Ok(tiles) = Tiles::open(&path, 2) else { return false };
        // Heights that are not reported as damaged are unchanged.
        let [x0, y0, x1, y1] = field.bounds();
        for k in 0..50 {
            let f = f64::from(k) / 49.0;
            let (x, y) = (x0 + f * (x1 - x0), y0 + f * (y1 - y0));
            let answer = tiles.ground(x, y);
            if tiles.failure().is_none() {
                assert_eq!(answer, field.ground(x, y));
            }
        }
        tiles.failure().is_none()
    });
}

/// Heights as a tile holds them: first bytes, then second ones and so on, deflated.
fn packed(heights: &[f32]) -> Vec<u8> {
    let byte = |plane: usize| heights.iter().map(move |h| h.to_le_bytes()[plane]);
    let planes: Vec<u8> = (0..4).flat_map(byte).collect();
    let mut out = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    out.write_all(&planes).unwrap();
    out.finish().unwrap()
}

/// A map of 100 000 by 100 000 nodes, of which all tiles of one size are one piece of the file. Measured here: opened
/// in 20 ms, 77 MB more after some 800 tiles.
#[test]
fn ten_thousand_million_nodes_open_at_once_and_take_bounded_memory() {
    let _alone = ALONE.lock().unwrap();
    const NODES: usize = 100_000;
    const TILE: usize = 256;
    let across = (NODES - 1).div_ceil(TILE);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.tiles");
    let mut file = std::fs::File::create(&path).unwrap();
    let mut at = 104 + 16 * (across * across) as u64;
    file.seek(SeekFrom::Start(at)).unwrap();
    let mut put = |heights: &[f32]| {
        let bytes = packed(heights);
        file.write_all(&bytes).unwrap();
        let entry = [
            at.to_le_bytes().as_slice(),
            &(bytes.len() as u32).to_le_bytes(),
            &crc32fast::hash(&bytes).to_le_bytes(),
        ]
        .concat();
        at += bytes.len() as u64;
        entry
    };
    // A tile has nodes one before its cells and two after them along each axis, if the map has
    // them.
    let span = |t: usize| (t * TILE + TILE + 2).min(NODES) - (t * TILE).saturating_sub(1);
    let mut pieces = BTreeMap::new();
    let mut index = Vec::new();
    for k in 0..across * across {
        let (nx, ny) = (span(k % across), span(k / across));
        let made = |n: usize| ((n % nx) as f32 * 0.1).sin() + (n / nx) as f32 * 1e-3;
        let piece = pieces
            .entry((nx, ny))
            .or_insert_with(|| put(&(0..nx * ny).map(made).collect::<Vec<f32>>()));
        index.extend_from_slice(piece);
    }
    let step = (NODES - 1).div_ceil(1023);
    let shown = (NODES - 1) / step + 1;
    let overview = put(&vec![0.0; shown * shown]);
    let mut head = b"LWTILES2".to_vec();
    [NODES as u64; 2].iter().for_each(|n| head.extend(n.to_le_bytes()));
    [TILE as u32, step as u32].iter().for_each(|n| head.extend(n.to_le_bytes()));
    [1.0_f64, 1.0, 0.0, 0.0].iter().for_each(|x| head.extend(x.to_le_bytes()));
    head.extend(overview);
    [-1.0_f32, 2.0].iter().for_each(|h| head.extend(h.to_le_bytes()));
    head.extend(0_u64.to_le_bytes());
    head.extend(0_f64.to_le_bytes());
    head.extend(crc32fast::hash(&index).to_le_bytes());
    head.extend(crc32fast::hash(&head).to_le_bytes());
    file.seek(SeekFrom::Start(0)).unwrap();
    file.write_all(&[head, index].concat()).unwrap();
    drop(file);

    let before = mutate::most_memory();
    #[allow(clippy::disallowed_methods)] // This test measures time.
    let clock = std::time::Instant::now();
    let tiles = Tiles::open(&path, 256).unwrap();
    let (every, overview) = tiles.overview().unwrap();
    let opened = clock.elapsed();
    // Query points across the whole map and along the edge of a tile, in some 800 tiles.
    for k in 0..100_000 {
        let f = f64::from(k) / 99_999.0;
        let there = 99_999.0 * f;
        let answer = tiles.ground(there, 99_999.0 - there);
        assert!(answer.is_some(), "{f} {:?}", tiles.failure());
        if k % 16 == 0 {
            tiles.ground(256.0 * 100.0, there).unwrap();
        }
    }
    let after = mutate::most_memory();
    println!("opened in {opened:?}, {} tiles kept, memory {before:?} to {after:?}", tiles.kept());
    assert_eq!((tiles.kept(), every, overview.nx), (256, step, shown));
    // The middle of a tile follows the formula of the tile. With the additional node before, node (300, 1000) has the
    // numbers 45 and 233 in its tile.
    let (h, _) = tiles.ground(300.0, 1000.0).unwrap();
    assert!((h - f64::from((45.0_f32 * 0.1).sin() + 233.0 * 1e-3)).abs() < 1e-6, "{h}");
    assert!(opened.as_secs_f64() < 0.5, "{opened:?}");
    if let (Some(before), Some(after)) = (before, after) {
        assert!(after.saturating_sub(before) < 150 << 20, "{before} {after}");
    }
}
