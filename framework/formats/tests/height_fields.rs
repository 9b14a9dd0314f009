//! Height fields of MJCF files, compared with the data of MuJoCo 4.0 (`hfield_data`, `body_mass`, `body_inertia`).

use linkwork_formats::{Description, Geometry, ReadOptions, ShapeRole, read_file, read_mjcf};
use std::path::Path;

/// A file with one height field on the world.
fn text(asset: &str) -> String {
    format!(
        r#"<mujoco><asset><hfield name="h" {asset}/></asset><worldbody><geom name="g" type="hfield" hfield="h" pos="0.1 0.2 0.3" euler="0 0 30"/></worldbody></mujoco>"#
    )
}

fn read(text: &str) -> Description {
    read_mjcf(text, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(text: &str) -> String {
    read_mjcf(text, &ReadOptions::default()).expect_err("refused").to_string()
}

/// Columns, spacing and heights of the collision shape.
fn field(d: &Description) -> (usize, [f64; 2], Vec<f64>) {
    let all: Vec<_> = d.shapes.iter().filter(|s| s.role == ShapeRole::Collision).collect();
    assert_eq!((all.len(), all[0].body.as_str(), all[0].name.as_str()), (1, "world", "g"));
    match &all[0].geometry {
        Geometry::HeightField { columns, spacing, heights } => {
            (*columns, *spacing, heights.clone())
        }
        other => panic!("{other:?}"),
    }
}

/// MuJoCo's data are 32 bit numbers, here times the height of 0.5 m.
#[track_caller]
fn close(own: &[f64], data: &[f64]) {
    let same = own.iter().zip(data).all(|(a, b)| (a - 0.5 * b).abs() < 2e-8);
    assert!(own.len() == data.len() && same, "{own:?} {data:?}");
}

/// `elevation` begins with the row of the largest y.
#[test]
fn written_heights_have_their_rows_turned_and_their_range_scaled() {
    let d = read(&text(
        r#"nrow="3" ncol="4" size="3 2 0.5 0.1" elevation="0 1 2 3  4 5 6 7  8 9 20 11""#,
    ));
    let (columns, spacing, heights) = field(&d);
    assert_eq!((columns, spacing), (4, [2.0, 2.0]));
    close(&heights, &[0.4, 0.45, 1.0, 0.55, 0.2, 0.25, 0.3, 0.35, 0.0, 0.05, 0.1, 0.15]);
    let place = d.shapes[0].pose.position;
    assert_eq!([place.x, place.y, place.z], [0.1, 0.2, 0.3]);
    // Only the surface collides, and not the base; this is a warning.
    assert!(
        d.ignored.iter().any(|i| i.what.contains("its base do not collide")),
        "{:?}",
        d.ignored
    );
    let d = read(&text(r#"nrow="2" ncol="2" size="3 2 0.5 0.1" elevation="-1 2 -7 3""#));
    close(&field(&d).2, &[0.0, 1.0, 0.6, 0.9]);
    for flat in [r#"elevation="2 2 2 2""#, ""] {
        let d = read(&text(&format!(r#"nrow="2" ncol="2" size="3 2 0.5 0.1" {flat}"#)));
        assert_eq!(field(&d).2, [0.0; 4]);
    }
}

/// A grey PNG of 8 or 16 bits, as MuJoCo's reader sees it.
fn png(rows: &[[u16; 3]], depth: png::BitDepth) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, 3, rows.len() as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().unwrap();
    let bytes = rows.iter().flatten().flat_map(|v| match depth {
        png::BitDepth::Sixteen => v.to_be_bytes().to_vec(),
        _ => vec![*v as u8],
    });
    writer.write_image_data(&bytes.collect::<Vec<u8>>()).unwrap();
    writer.finish().unwrap();
    out
}

fn with_file(name: &str, bytes: &[u8], more: &str) -> Result<Description, String> {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("fields");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join(name), bytes).unwrap();
    let text = text(&format!(r#"file="{name}" size="3 2 0.5 0.1" {more}"#));
    let text = text.replace("<mujoco>", r#"<mujoco><compiler meshdir="fields"/>"#);
    let file = dir.path().join("world.xml");
    std::fs::write(&file, text).unwrap();
    read_file(Path::new(&file), &ReadOptions::default()).map_err(|e| e.to_string())
}

/// Of 16 bits, MuJoCo reads the upper 8.
#[test]
fn images_and_binary_files_have_the_heights_of_mujoco() {
    let eight = png(&[[10, 20, 30], [40, 200, 60]], png::BitDepth::Eight);
    let (columns, spacing, heights) = field(&with_file("a.png", &eight, "").unwrap());
    assert_eq!((columns, spacing), (3, [3.0, 4.0]));
    close(&heights, &[0.15789473, 1.0, 0.2631579, 0.0, 0.05263158, 0.10526316]);
    let sixteen = png(&[[1000, 20000, 30000], [40000, 60000, 6000]], png::BitDepth::Sixteen);
    let (_, _, heights) = field(&with_file("b.png", &sixteen, "").unwrap());
    close(&heights, &[0.66233766, 1.0, 0.08658009, 0.0, 0.32467532, 0.4935065]);
    let mut binary = [2_i32, 3].iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    binary.extend([1.0_f32, 2.0, 3.0, 4.0, 5.0, 9.0].iter().flat_map(|h| h.to_le_bytes()));
    let kind = r#"content_type="image/vnd.mujoco.hfield""#;
    let (_, _, heights) = field(&with_file("c.bin", &binary, kind).unwrap());
    close(&heights, &[0.0, 0.125, 0.25, 0.375, 0.5, 1.0]);
    let short = with_file("c.bin", &binary[..28], kind).unwrap_err();
    assert!(short.contains("2 by 3 points, but it has 5 heights"), "{short}");
    let kind = with_file("c.bin", &binary, r#"content_type="image/jpeg""#).unwrap_err();
    assert!(kind.contains("image/vnd.mujoco.hfield"), "{kind}");
    // The heights of the file replace the attributes of the element.
    let d = with_file("a.png", &eight, r#"nrow="3""#).unwrap();
    assert!(d.ignored.iter().any(|i| i.what.contains("nrow")), "{:?}", d.ignored);
}

/// MuJoCo's mass of a height field is that of a box of 6 m × 4 m × 0.35 m.
#[test]
fn a_height_field_on_a_body_has_the_mass_of_a_box() {
    let body = r#"<mujoco><asset><hfield name="h" nrow="2" ncol="2" size="3 2 0.5 0.1"/></asset><worldbody><body name="b"><joint/><geom size=".1"/><geom type="hfield" hfield="h" MASS/></body></worldbody></mujoco>"#;
    for (mass, total, moments) in [
        ("mass=\"1\"", 5.1887902, [1.36029683, 3.02696349, 4.35008849]),
        ("", 8404.1887902, [11285.76675516, 25285.76675516, 36400.01675516]),
    ] {
        let d = read(&body.replace("MASS", mass));
        let m = d.builder.bodies()[0].mass;
        assert!((m.mass - total).abs() < 1e-7, "{}", m.mass);
        for (k, own) in moments.iter().enumerate() {
            assert!((m.inertia_com[(k, k)] - own).abs() < 1e-7 * own, "{}", m.inertia_com);
        }
    }
}

#[test]
fn mistakes_in_height_fields_are_rejected_with_a_remedy() {
    for (asset, message) in [
        (r#"nrow="2" ncol="2" size="3 2 0.5 0""#, "four positive lengths"),
        (r#"nrow="2" ncol="2""#, "lacks `size`"),
        (r#"nrow="2" ncol="2" size="3 2 1 1" elevation="1 2 3""#, "4 finite numbers"),
        (r#"nrow="1" ncol="2" size="3 2 1 1" elevation="1 2""#, "an integer of at least 2"),
        (r#"size="3 2 1 1" elevation="1 2""#, "lacks `nrow`"),
        (r#"nrow="2" ncol="2" size="3 2 1 1" elevation="1 2 nan 3""#, "4 finite numbers"),
        (r#"nrow="9e5" ncol="9e5" size="3 2 1 1""#, "the limit is 64000000 points"),
    ] {
        let found = refused(&text(asset));
        assert!(found.contains(message), "{found}");
    }
    let other = text(r#"nrow="2" ncol="2" size="3 2 1 1""#).replace("hfield=\"h\"", "hfield=\"i\"");
    assert!(refused(&other).contains("height field `i`"), "{}", refused(&other));
    // A file that does not exist is a warning, as for meshes.
    let d = read(&text(r#"file="none.png" size="3 2 1 1""#));
    assert!(d.ignored.iter().any(|i| i.what.contains("`none.png` of its height field")));
    assert!(d.shapes.is_empty());
}
