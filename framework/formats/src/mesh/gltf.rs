//! Triangles of a glTF 2.0 file, as text (`.gltf`) or binary (`.glb`): all triangle meshes of its scene.
//!
//! In the format, +y is up; robots have +z up, so (x, y, z) of the file is (x, −z, y) here, as in Drake.

use linkwork_spatial::nalgebra::{Matrix4, Quaternion, Unit};
use linkwork_spatial::{Quat, Vec3};
use serde_json::Value;
use std::path::Path;

/// Maximum number of corners of a file, so that nodes that share meshes cannot fill the memory.
const CORNERS: usize = 30_000_000;

/// Returns the corners of the triangles, three for each.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Vec<Vec3>, String> {
    let (json, chunk) = match bytes.starts_with(b"glTF") {
        true => parts(bytes)?,
        false => (bytes, None),
    };
    let json = json.strip_prefix(crate::read::BYTE_ORDER_MARK).unwrap_or(json);
    let json: Value = serde_json::from_slice(json).map_err(|e| format!("its JSON: {e}"))?;
    let version = json["asset"]["version"].as_str().unwrap_or("none");
    if !version.starts_with("2.") {
        return Err(format!("its glTF version is {version}, not 2"));
    }
    let required = list(&json["extensionsRequired"]).iter().filter_map(Value::as_str);
    if let Some(extension) = required.into_iter().find(|name| !keeps_shape(name)) {
        return Err(format!("it requires the extension {extension}, which is not supported"));
    }
    let buffers = list(&json["buffers"]).iter().map(|b| buffer(b, chunk, path));
    let buffers: Vec<Vec<u8>> = buffers.collect::<Result<_, String>>()?;
    let mut file = File { json: &json, buffers, out: Vec::new() };
    let scene = json["scene"].as_u64().unwrap_or(0) as usize;
    let scene = list(&json["scenes"]).get(scene).ok_or("it does not have a scene")?;
    for node in list(&scene["nodes"]) {
        file.node(node, Matrix4::identity(), 0)?;
    }
    if file.out.is_empty() {
        return Err("it has no triangles".into());
    }
    Ok(file.out.iter().map(|p| Vec3::new(p.x, -p.z, p.y)).collect())
}

/// Returns whether positions and indices can be read without knowing an extension: it concerns materials or textures, or the types of positions that
/// `File::points` reads.
fn keeps_shape(extension: &str) -> bool {
    let looks = ["KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_"];
    extension == "KHR_mesh_quantization" || looks.iter().any(|start| extension.starts_with(start))
}

fn list(v: &Value) -> &[Value] {
    v.as_array().map_or(&[], Vec::as_slice)
}

/// Returns the JSON and the binary chunk of a `.glb` file.
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let cut = "the file is truncated";
    let number = |at: usize| -> Option<usize> {
        let four: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(four) as usize)
    };
    if number(4) != Some(2) {
        return Err("its glTF version is not 2".into());
    }
    let (mut at, mut json, mut binary) = (12, None, None);
    while at + 8 <= bytes.len() {
        let length = number(at).ok_or(cut)?;
        let content = bytes.get(at + 8..at + 8 + length).ok_or(cut)?;
        match &bytes[at + 4..at + 8] {
            b"JSON" => json = json.or(Some(content)),
            b"BIN\0" => binary = binary.or(Some(content)),
            _ => {}
        }
        at += 8 + length.next_multiple_of(4);
    }
    Ok((json.ok_or(cut)?, binary))
}

/// Returns the bytes of a buffer: from the file, a data URI, or another file in the same folder.
fn buffer(b: &Value, chunk: Option<&[u8]>, path: &Path) -> Result<Vec<u8>, String> {
    match b["uri"].as_str() {
        None => chunk.map(<[u8]>::to_vec).ok_or("a buffer does not have data".into()),
        Some(uri) if uri.starts_with("data:") => {
            let data = uri.split_once(";base64,").ok_or("a data URI is not base64")?.1;
            base64(data).ok_or("a data URI is not base64".into())
        }
        Some(uri) => {
            let decoded =
                unescaped(uri).ok_or_else(|| format!("its buffer `{uri}` is not a URI"))?;
            let name = Path::new(&decoded);
            let plain = name.components().all(|c| matches!(c, std::path::Component::Normal(_)));
            if !plain {
                return Err(format!("its buffer `{uri}` is not in the folder of the file"));
            }
            let beside = path.parent().unwrap_or(Path::new("")).join(name);
            crate::whole_file(&beside).map_err(|e| format!("`{uri}`: {e}"))
        }
    }
}

/// Decodes `%20` and the like in a URI.
fn unescaped(uri: &str) -> Option<String> {
    let (mut out, mut rest) = (Vec::with_capacity(uri.len()), uri.as_bytes());
    while let Some((first, behind)) = rest.split_first() {
        rest = behind;
        if *first != b'%' {
            out.push(*first);
            continue;
        }
        let digits = std::str::from_utf8(rest.get(..2)?).ok()?;
        out.push(u8::from_str_radix(digits, 16).ok()?);
        rest = &rest[2..];
    }
    String::from_utf8(out).ok()
}

fn base64(text: &str) -> Option<Vec<u8>> {
    let (mut out, mut bits, mut count) = (Vec::with_capacity(text.len() / 4 * 3), 0_u32, 0);
    for c in text.bytes().filter(|c| !c.is_ascii_whitespace() && *c != b'=') {
        let six = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(six);
        count += 6;
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    Some(out)
}

struct File<'j> {
    json: &'j Value,
    buffers: Vec<Vec<u8>>,
    out: Vec<Vec3>,
}

impl<'j> File<'j> {
    fn at(&self, kind: &str, index: &Value) -> Result<&'j Value, String> {
        let all = list(&self.json[kind]);
        let found = index.as_u64().and_then(|i| all.get(i as usize));
        found.ok_or_else(|| format!("there is no entry {index} of `{kind}`"))
    }

    fn node(&mut self, index: &Value, outer: Matrix4<f64>, depth: usize) -> Result<(), String> {
        if depth > 100 {
            return Err("references between nodes are circular, or deeper than 100".into());
        }
        let node = self.at("nodes", index)?;
        let X = outer * transform(node)?;
        if !node["mesh"].is_null() {
            for primitive in list(&self.at("meshes", &node["mesh"])?["primitives"]) {
                self.primitive(primitive, &X)?;
            }
        }
        list(&node["children"]).iter().try_for_each(|child| self.node(child, X, depth + 1))
    }

    fn primitive(&mut self, p: &Value, X: &Matrix4<f64>) -> Result<(), String> {
        let mode = p["mode"].as_u64().unwrap_or(4);
        if !(4..=6).contains(&mode) {
            return Ok(()); // points and lines
        }
        let points = self.points(&p["attributes"]["POSITION"])?;
        let indices: Vec<usize> = match p["indices"].is_null() {
            true => (0..points.len()).collect(),
            false => self.indices(&p["indices"])?,
        };
        let corner = |k: usize| -> Result<Vec3, String> {
            let p = points.get(k).ok_or("a triangle refers to a vertex that does not exist")?;
            Ok((X * p.push(1.0)).xyz())
        };
        let corners = indices.into_iter().map(corner).collect::<Result<Vec<Vec3>, String>>()?;
        if self.out.len() + 3 * corners.len() > CORNERS {
            return Err(format!("it has more than {CORNERS} corners"));
        }
        match mode {
            4 => self.out.extend(corners.chunks_exact(3).flatten()),
            5 => {
                for (k, w) in corners.windows(3).enumerate() {
                    let [a, b] = if k % 2 == 0 { [w[0], w[1]] } else { [w[1], w[0]] };
                    self.out.extend([a, b, w[2]]);
                }
            }
            _ => {
                for w in corners.get(1..).unwrap_or_default().windows(2) {
                    self.out.extend([corners[0], w[0], w[1]]);
                }
            }
        }
        Ok(())
    }

    /// Returns the bytes of `count` entries of `size` bytes in a view, from an offset.
    fn part(
        &self,
        view: &Value,
        offset: &Value,
        count: usize,
        size: usize,
    ) -> Result<Vec<&[u8]>, String> {
        let view = self.at("bufferViews", view)?;
        let buffer = self.buffers.get(whole(&view["buffer"])).ok_or("a buffer does not exist")?;
        let stride = view["byteStride"].as_u64().map_or(size, |s| s as usize).max(1);
        let start = whole(&view["byteOffset"]).saturating_add(whole(offset));
        let entry = |k: usize| {
            let at = k.checked_mul(stride)?.checked_add(start)?;
            buffer.get(at..at.checked_add(size)?)
        };
        let all: Option<Vec<&[u8]>> = (0..count).map(entry).collect();
        all.ok_or("an accessor is longer than its buffer".into())
    }

    /// Returns the bytes of each entry of an accessor. A sparse accessor replaces some entries of its view, or of zeros.
    fn entries(&self, accessor: &Value, size: usize) -> Result<Vec<&[u8]>, String> {
        const ZEROS: [u8; 12] = [0; 12];
        let count = whole(&accessor["count"]);
        let sparse = &accessor["sparse"];
        let mut all = match (&accessor["bufferView"], sparse.is_null()) {
            (Value::Null, false) if count <= CORNERS => vec![&ZEROS[..size]; count],
            (view, _) => self.part(view, &accessor["byteOffset"], count, size)?,
        };
        if sparse.is_null() {
            return Ok(all);
        }
        let (places, values) = (&sparse["indices"], &sparse["values"]);
        let replaced = whole(&sparse["count"]);
        let width = index_size(places)?;
        let places = self.part(&places["bufferView"], &places["byteOffset"], replaced, width)?;
        let values = self.part(&values["bufferView"], &values["byteOffset"], replaced, size)?;
        for (place, value) in places.into_iter().zip(values) {
            *all.get_mut(integer(place))
                .ok_or("a sparse accessor has an index beyond its end")? = value;
        }
        Ok(all)
    }

    fn points(&self, index: &Value) -> Result<Vec<Vec3>, String> {
        let accessor = self.at("accessors", index)?;
        let wrong = || "positions must be three numbers of 8, 16 or 32 bits".to_string();
        // Integers are quantized positions (KHR_mesh_quantization); normalized integers are fractions of the
        // largest one.
        let (size, largest) = match accessor["componentType"].as_u64() {
            Some(5120) => (1, 127.0),
            Some(5121) => (1, 255.0),
            Some(5122) => (2, 32_767.0),
            Some(5123) => (2, 65_535.0),
            Some(5126) => (4, 1.0),
            _ => return Err(wrong()),
        };
        if accessor["type"] != "VEC3" {
            return Err(wrong());
        }
        let signed = [5120, 5122].iter().any(|kind| accessor["componentType"] == *kind);
        let number = |b: &[u8]| match b {
            [a] if signed => f64::from(i8::from_le_bytes([*a])),
            [a, b] if signed => f64::from(i16::from_le_bytes([*a, *b])),
            [a, b, c, d] => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            _ => integer(b) as f64,
        };
        let fraction = accessor["normalized"] == true;
        let scaled = |x: f64| if fraction { (x / largest).max(-1.0) } else { x };
        let point = |b: &[u8]| {
            Vec3::from_iterator(b.chunks_exact(size).map(|component| scaled(number(component))))
        };
        Ok(self.entries(accessor, 3 * size)?.into_iter().map(point).collect())
    }

    fn indices(&self, index: &Value) -> Result<Vec<usize>, String> {
        let accessor = self.at("accessors", index)?;
        let size = index_size(accessor)?;
        Ok(self.entries(accessor, size)?.into_iter().map(integer).collect())
    }
}

fn whole(v: &Value) -> usize {
    v.as_u64().unwrap_or(0) as usize
}

/// Reads an unsigned integer, the lowest byte first.
fn integer(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0_usize, |n, b| n << 8 | usize::from(*b))
}

/// Returns the number of bytes of an index.
fn index_size(accessor: &Value) -> Result<usize, String> {
    match accessor["componentType"].as_u64() {
        Some(5121) => Ok(1),
        Some(5123) => Ok(2),
        Some(5125) => Ok(4),
        other => Err(format!("indices of the type {other:?} are not supported")),
    }
}

fn transform(node: &Value) -> Result<Matrix4<f64>, String> {
    let numbers = |name: &str, usual: &[f64]| -> Result<Vec<f64>, String> {
        if node[name].is_null() {
            return Ok(usual.to_vec());
        }
        let all: Vec<f64> = list(&node[name]).iter().filter_map(Value::as_f64).collect();
        if all.len() == usual.len() { Ok(all) } else { Err(format!("`{name}` of a node is wrong")) }
    };
    if !node["matrix"].is_null() {
        return Ok(Matrix4::from_column_slice(&numbers("matrix", &[0.0; 16])?));
    }
    let (t, s) = (numbers("translation", &[0.0; 3])?, numbers("scale", &[1.0; 3])?);
    let r = numbers("rotation", &[0.0, 0.0, 0.0, 1.0])?;
    let raw = Quaternion::new(r[3], r[0], r[1], r[2]);
    let turn: Quat = Unit::try_new(raw, 1e-12).ok_or("a rotation of a node is zero")?;
    let move_ = Matrix4::new_translation(&Vec3::new(t[0], t[1], t[2]));
    Ok(move_
        * turn.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&Vec3::new(s[0], s[1], s[2])))
}
