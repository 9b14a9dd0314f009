//! Tiles give the heights of one array, bit for bit, whatever is asked in whatever order; damage is told.
use super::*;
use crate::height_field::HeightField;
use crate::random::Random;
use std::path::PathBuf;

/// Random heights, with holes and one tile without any.
fn field(nx: usize, ny: usize) -> HeightField {
    let mut random = Random::new(9, 1);
    let mut heights: Vec<f32> = (0..nx * ny).map(|_| random.between(-3.0, 5.0) as f32).collect();
    for k in (0..nx * ny).step_by(97) {
        heights[k] = f32::NAN;
    }
    for j in 30..60.min(ny) {
        for i in 30..60.min(nx) {
            heights[j * nx + i] = f32::NAN;
        }
    }
    HeightField::new([-7.25, 11.5], [0.5, 0.75], nx, ny, heights).unwrap()
}

fn written(folder: &tempfile::TempDir, field: &HeightField, tile: usize) -> PathBuf {
    let path = folder.path().join("a.tiles");
    write_tiles(&path, &mut &*field, tile).unwrap();
    path
}

/// Points on the whole map and around it, on nodes and borders too.
fn points(field: &HeightField, count: usize, seed: u64) -> Vec<[f64; 2]> {
    let mut random = Random::new(seed, 2);
    let [x0, y0, x1, y1] = field.bounds();
    let mut out = vec![[x0, y0], [x1, y1], [x0, y1], [x1, y0], [f64::NAN, 0.0]];
    for k in 0..count {
        let (x, y) = (random.between(x0 - 1.0, x1 + 1.0), random.between(y0 - 1.0, y1 + 1.0));
        let s = field.spacing();
        out.push(match k % 4 {
            0 => [x0 + ((x - x0) / s[0]).round() * s[0], y],
            1 => [x0 + ((x - x0) / s[0]).round() * s[0], y0 + ((y - y0) / s[1]).round() * s[1]],
            _ => [x, y],
        });
    }
    out
}

fn bits(answer: Option<(f64, linkwork_spatial::Vec3)>) -> [u64; 4] {
    answer.map_or([0; 4], |(h, n)| [h, n.x, n.y, n.z].map(f64::to_bits))
}

#[test]
fn answers_are_those_of_one_array_bit_for_bit_in_any_order_with_any_cache() {
    let folder = tempfile::tempdir().unwrap();
    // Test sizes that end within a tile, at its end, and one node after it.
    for (nx, ny) in [(70, 95), (65, 129), (66, 34), (2, 3), (17, 18)] {
        let field = field(nx, ny);
        let path = written(&folder, &field, 16);
        let all = points(&field, 4000, 5);
        for most in [1, 3, 1000] {
            let tiles = Tiles::open(&path, most).unwrap();
            for (k, [x, y]) in all.iter().chain(all.iter().rev()).enumerate() {
                let (got, want) = (tiles.ground(*x, *y), field.ground(*x, *y));
                assert_eq!(bits(got), bits(want), "{nx} {ny} {most} point {k}: {x} {y}");
            }
            assert!(tiles.kept() <= most && tiles.failure().is_none());
        }
        // The terrain has the same heights at another place and with another scale.
        let centred = Tiles::open(&path, 2).unwrap().centred().scaled(0.3, 1.5);
        let mut other = field.clone().centred();
        other.map(|_, _, h| (h - 0.3) * 1.5);
        assert_eq!(centred.grid().bounds(), other.bounds());
        for [x, y] in points(&other, 500, 6) {
            assert_eq!(bits(centred.ground(x, y)), bits(other.ground(x, y)));
        }
    }
}

#[test]
fn rows_regions_overview_and_counts_are_those_of_the_array() {
    let folder = tempfile::tempdir().unwrap();
    let field = field(70, 95);
    let path = written(&folder, &field, 16);
    let tiles = Tiles::open(&path, 6).unwrap();
    let same = |a: &[f32], b: &[f32]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
    };
    let mut row = vec![0.0; 70];
    for j in 0..95 {
        HeightRows::row(&mut &tiles, j, &mut row).unwrap();
        assert!(same(&row, &field.heights()[j * 70..(j + 1) * 70]), "row {j}");
    }
    let holes = field.heights().iter().filter(|h| h.is_nan()).count();
    assert_eq!(tiles.missing(), holes as u64);
    let range = field.heights().iter().fold([f32::NAN; 2], |[a, b], h| [a.min(*h), b.max(*h)]);
    assert_eq!(tiles.range(), range);
    let (step, all) = tiles.overview().unwrap();
    assert!(step == 1 && same(&all.heights, field.heights()));
    let [x0, y0, x1, y1] = field.bounds();
    let whole = tiles.region([x0, y0, x1, y1], 70 * 95).unwrap();
    assert!(same(&whole.heights, field.heights()) && whole.origin == field.origin());
    let part = tiles.region([x0 + 10.0 * 0.5, y0 + 3.1, x0 + 40.2 * 0.5, y0 + 60.0], 5000).unwrap();
    assert_eq!((part.nx, part.ny, part.origin), (31, 76, [x0 + 5.0, y0 + 5.0 * 0.75]));
    for j in 0..76 {
        let want = &field.heights()[(j + 5) * 70 + 10..][..31];
        assert!(same(&part.heights[j * 31..(j + 1) * 31], want), "row {j}");
    }
    let told = tiles.region([x0, y0, x1 + 1.0, y1], 1 << 20).unwrap_err().to_string();
    assert!(told.contains("is not on the map") && told.contains("the map extends over"), "{told}");
    let told = tiles.region([x0, y0, x1, y1], 6649).unwrap_err().to_string();
    assert!(told.contains("70 by 95 nodes") && told.contains("at most 6649 nodes"), "{told}");
    assert!(tiles.region([0.0, f64::NAN, 1.0, 14.0], 100).is_err());
    // This map is larger than an overview.
    let wide =
        HeightField::new([0.0; 2], [1.0; 2], 3000, 20, (0..60_000).map(|k| k as f32).collect())
            .unwrap();
    let tiles = Tiles::open(&written(&folder, &wide, 64), 100).unwrap();
    let (step, all) = tiles.overview().unwrap();
    assert_eq!((step, all.nx, all.ny, all.spacing), (3, 1000, 7, [3.0, 3.0]));
    assert_eq!(all.heights[1003], 9009.0);
}

#[test]
fn a_damaged_tile_is_no_ground_and_is_told_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let field = field(70, 95);
    let path = written(&folder, &field, 16);
    let sound = std::fs::read(&path).unwrap();
    let head = head::Head::read(&mut sound.as_slice(), sound.len() as u64).unwrap();
    // Damage tile (3, 1); a row has five tiles.
    let at = head.index[8].start as usize + 5;
    let mut bytes = sound.clone();
    bytes[at] ^= 4;
    std::fs::write(&path, &bytes).unwrap();
    let tiles = Tiles::open(&path, 4).unwrap();
    let s = field.spacing();
    let there = |i: f64, j: f64| (field.origin()[0] + i * s[0], field.origin()[1] + j * s[1]);
    let (x, y) = there(3.5, 3.5);
    assert_eq!(bits(tiles.ground(x, y)), bits(field.ground(x, y)));
    assert!(tiles.failure().is_none());
    let (x, y) = there(49.5, 18.5);
    assert_eq!(tiles.ground(x, y), None);
    let told = tiles.failure().unwrap().to_string();
    assert!(told.contains("tile 3, 1 (from the south-west): its checksum is wrong"), "{told}");
    assert!(told.contains("linkwork terrain convert"), "{told}");
    // Truncate the file within the same tile.
    std::fs::write(&path, &sound[..at]).unwrap();
    let tiles = Tiles::open(&path, 4).unwrap();
    assert_eq!(tiles.ground(x, y), None);
    assert!(tiles.failure().unwrap().to_string().contains("beyond the end"));
    assert!(tiles.overview().unwrap_err().to_string().contains("the overview: its bytes"));
    // Checksums cover every bit of the head and the index.
    for k in (0..head::HEAD as usize + 16 * head.index.len()).step_by(3) {
        let mut bytes = sound.clone();
        bytes[k] ^= 1 << (k % 8);
        std::fs::write(&path, &bytes).unwrap();
        let told = Tiles::open(&path, 4).unwrap_err();
        assert!(matches!(told, TileError::Damaged { .. }), "byte {k}: {told}");
    }
    let told = Tiles::open(folder.path(), 4).unwrap_err().to_string();
    assert!(told.contains("not a regular file"), "{told}");
    for length in [0, 7, 100, 110] {
        std::fs::write(&path, &sound[..length]).unwrap();
        let told = Tiles::open(&path, 4).unwrap_err().to_string();
        assert!(told.contains("it ends within"), "{length}: {told}");
    }
    assert!(
        Tiles::open(&folder.path().join("none.tiles"), 4)
            .unwrap_err()
            .to_string()
            .starts_with("opening: ")
    );
}

/// What is packed in a tile is unpacked as far as the tile goes, and a head that claims more than there is takes nothing.
#[test]
fn bombs_and_claims_are_refused() {
    use std::io::Write;
    let mut pack = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    for _ in 0..64 {
        pack.write_all(&vec![0; 1 << 20]).unwrap();
    }
    let bomb = pack.finish().unwrap();
    let (mut planes, mut heights) = (Vec::new(), vec![0.0; 64]);
    let told = head::unpack(&bomb, &mut planes, &mut heights).unwrap_err().to_string();
    assert!(
        told.contains("are longer than its nodes require") && planes.capacity() < 1 << 16,
        "{told}"
    );
    let short = head::pack(&[1.0; 63]).unwrap();
    assert!(head::unpack(&short, &mut planes, &mut heights).is_err());
    let infinite = head::pack(&[f32::INFINITY; 64]).unwrap();
    assert!(head::unpack(&infinite, &mut planes, &mut heights).is_err());
    let grid =
        linkwork_collision::relief::Lattice::new([0.0; 2], [1.0; 2], 100_000, 100_000).unwrap();
    let mut bytes = Vec::new();
    head::Head::new(grid, 256).unwrap().write(&mut bytes).unwrap();
    assert!(bytes.len() as u64 <= INDEX_END, "100 000 by 100 000 nodes have an index");
    let told = head::Head::read(&mut &bytes[..1000], 1000).unwrap_err().to_string();
    assert!(told.contains("it ends within its index"), "{told}");
    assert!(head::Head::new(grid, 16).unwrap_err().to_string().contains("too many for an index"));
    assert!(head::Head::new(grid, 4).is_err());
}
