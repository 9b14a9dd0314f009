//! Notations of mesh files that public reports are about. Each file has the same triangle; `tests/hunt/meshes.md` lists the reports.
use linkwork_formats::mesh_corners;
use linkwork_formats::spatial::Vec3;
use std::path::Path;

/// The corners of the triangle in the axes of a robot; in a glTF file they are (x, z, −y).
const CORNERS: [[f64; 3]; 3] = [[0.5, -1.0, 2.0], [1.5, -1.0, 2.0], [0.5, -1.0, 4.0]];

/// Greatest distance of a corner (m): a step of quantized positions is 1.2e-4 m.
const WITHIN: f64 = 1e-4;

fn holds(name: &str, bytes: &[u8], others: &[(&str, Vec<u8>)]) -> Result<(), String> {
    let dir = tempfile::tempdir().unwrap();
    for (other, content) in others {
        std::fs::write(dir.path().join(other), content).unwrap();
    }
    std::fs::write(dir.path().join(name), bytes).unwrap();
    is_triangle(&dir.path().join(name))
}

fn is_triangle(path: &Path) -> Result<(), String> {
    let corners = mesh_corners(path)?;
    let same =
        corners.len() == 3 && (0..3).all(|k| (corners[k] - Vec3::from(CORNERS[k])).norm() < WITHIN);
    if same { Ok(()) } else { Err(format!("{corners:?}")) }
}

/// The parts of a glTF file that the cases change; the defaults are a plain file.
struct Gltf {
    node: &'static str,
    position: &'static str,
    index: &'static str,
    views: &'static str,
    more: &'static str,
    uri: &'static str,
    data: Vec<u8>,
}

impl Default for Gltf {
    fn default() -> Self {
        Gltf {
            node: "",
            position: r#""bufferView":0,"componentType":5126"#,
            index: r#""bufferView":1,"componentType":5123"#,
            views: r#"{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}"#,
            more: "",
            uri: "data.bin",
            data: [floats(&in_file(CORNERS)), vec![0, 0, 1, 0, 2, 0]].concat(),
        }
    }
}

fn in_file(corners: [[f64; 3]; 3]) -> Vec<f64> {
    corners.iter().flat_map(|p| [p[0], p[2], -p[1]]).collect()
}

fn floats(all: &[f64]) -> Vec<u8> {
    all.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect()
}

impl Gltf {
    fn read(self) -> Result<(), String> {
        let Gltf { node, position, index, views, more, uri, data } = self;
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},{more}"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{{node}"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "accessors":[{{{position},"count":3,"type":"VEC3"}},{{{index},"count":3,"type":"SCALAR"}}],
            "bufferViews":[{views}],"buffers":[{{"uri":"{uri}","byteLength":{}}}]}}"#,
            data.len()
        );
        holds("t.gltf", text.as_bytes(), &[("data.bin", data.clone()), ("my data.bin", data)])
    }
}

/// A 3 x 4 transformation of a point (x, y, z) of the file to (2x + 1, z − 3, −y): its inverse is applied to the stored corners.
fn moved() -> Vec<u8> {
    let stored: Vec<f64> = in_file(CORNERS)
        .chunks_exact(3)
        .flat_map(|p| [(p[0] - 1.0) / 2.0, -p[2], p[1] + 3.0])
        .collect();
    [floats(&stored), vec![0, 0, 1, 0, 2, 0]].concat()
}

#[test]
fn nodes_of_gltf_move_their_meshes() {
    Gltf::default().read().unwrap();
    // Matrices are stored by columns: KhronosGroup/glTF-Sample-Viewer #185, tinygltf #511, assimp
    // PR 885.
    let matrix = r#""matrix":[2,0,0,0, 0,0,-1,0, 0,1,0,0, 1,-3,0,1],"#;
    Gltf { node: matrix, data: moved(), ..Gltf::default() }.read().unwrap();
    // The scale acts before the rotation (about x by −90 degrees): filament PR 1573.
    let parts = r#""translation":[1,-3,0],"rotation":[-0.7071067811865476,0,0,0.7071067811865476],"scale":[2,1,1],"#;
    Gltf { node: parts, data: moved(), ..Gltf::default() }.read().unwrap();
}

#[test]
fn accessors_of_gltf_may_be_interleaved_sparse_and_quantized() {
    let corners = in_file(CORNERS);
    // Each vertex has 24 bytes with a normal: SwiftGLTF #2, glTFast #28.
    let mut strided = Vec::new();
    for p in corners.chunks_exact(3) {
        strided.extend(floats(p));
        strided.extend(floats(&[0.0, 0.0, 1.0]));
    }
    strided.extend([0, 0, 1, 0, 2, 0]);
    let views = r#"{"buffer":0,"byteLength":72,"byteStride":24},{"buffer":0,"byteOffset":72,"byteLength":6}"#;
    Gltf { views, data: strided, ..Gltf::default() }.read().unwrap();
    // Two of the three points replace zeros, with indices of 8 bits: GLTFKit2 #49. The first corner is (0.5, 2, 1), so
    // it is one of them.
    let position = r#""componentType":5126,"sparse":{"count":3,"indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":0}}"#;
    let views = r#"{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6},{"buffer":0,"byteOffset":42,"byteLength":3}"#;
    let backwards: Vec<f64> = corners.chunks_exact(3).rev().flatten().copied().collect();
    let data = [floats(&backwards), vec![0, 0, 1, 0, 2, 0], vec![2, 1, 0]].concat();
    Gltf { position, views, data, ..Gltf::default() }.read().unwrap();
    let position = r#""bufferView":0,"componentType":5126,"sparse":{"count":1,"indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":3}}"#;
    let views = r#"{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6},{"buffer":0,"byteOffset":42,"byteLength":1},{"buffer":0,"byteOffset":44,"byteLength":12}"#;
    let mut wrong = corners.clone();
    wrong[3..6].fill(9.0);
    let replaced = [1, 0].into_iter().chain(floats(&corners[3..6]));
    let data = [floats(&wrong), vec![0, 0, 1, 0, 2, 0], replaced.collect()].concat();
    Gltf { position, views, data: data.clone(), ..Gltf::default() }.read().unwrap();
    let beyond = Gltf {
        position,
        views,
        data: {
            let mut d = data;
            d[42] = 3;
            d
        },
        ..Gltf::default()
    };
    assert!(beyond.read().is_err_and(|e| e.contains("beyond its end")));
    // Quantized positions are written by gltfpack as fractions of 32767, and scaled by the node.
    let quantized: Vec<u8> =
        corners.iter().flat_map(|x| ((x / 4.0 * 32_767.0).round() as i16).to_le_bytes()).collect();
    let position = r#""bufferView":0,"componentType":5122,"normalized":true"#;
    let views = r#"{"buffer":0,"byteLength":18},{"buffer":0,"byteOffset":18,"byteLength":6}"#;
    let more = r#""extensionsRequired":["KHR_mesh_quantization","KHR_texture_transform"],"#;
    let data = [quantized, vec![0, 0, 1, 0, 2, 0]].concat();
    let node = r#""scale":[4.0,4.0,4.0],"#;
    Gltf { node, position, views, more, data, ..Gltf::default() }.read().unwrap();
}

#[test]
fn uris_are_decoded_and_extensions_of_materials_do_not_matter() {
    // A blank in a URI is `%20`: gltflib #162, meshoptimizer #138, cgltf PR 115.
    Gltf { uri: "my%20data.bin", ..Gltf::default() }.read().unwrap();
    let no_uri = Gltf { uri: "my%2.bin", ..Gltf::default() };
    assert!(no_uri.read().is_err_and(|e| e.contains("is not a URI")));
    let out = Gltf { uri: "%2e%2e/data.bin", ..Gltf::default() };
    assert!(out.read().is_err_and(|e| e.contains("not in the folder")));
    let more = r#""extensionsRequired":["KHR_materials_unlit"],"#;
    Gltf { more, ..Gltf::default() }.read().unwrap();
    let more = r#""extensionsRequired":["KHR_draco_mesh_compression"],"#;
    let packed = Gltf { more, ..Gltf::default() };
    assert!(packed.read().is_err_and(|e| e.contains("KHR_draco_mesh_compression")));
}

#[test]
fn colladas_say_what_is_not_read() {
    let dae = |node: &str, faces: &str| {
        let text = format!(
            r##"<COLLADA version="1.4.1"><library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">0.5 -1 2 1.5 -1 2 0.5 -1 4</float_array></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{faces}</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node>{node}<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"##
        );
        holds("t.dae", text.as_bytes(), &[])
    };
    let input = r##"<input semantic="VERTEX" source="#v" offset="0"/>"##;
    let plain = format!("<triangles count=\"1\">{input}<p>0 1 2</p></triangles>");
    dae("", &plain).unwrap();
    let skewed = dae("<skew>30 1 0 0 0 1 0</skew>", &plain);
    assert!(skewed.is_err_and(|e| e.contains("<skew>")));
    let holes =
        format!("<polygons count=\"1\">{input}<ph><p>0 1 2</p><h>0 2 1</h></ph></polygons>");
    assert!(dae("", &holes).is_err_and(|e| e.contains("holes")));
}
