//! Triangles of a COLLADA file (`.dae`): `triangles`, `polylist` and `polygons` of all meshes of its scene, in m.
//!
//! `<unit meter="..">` applies. `<up_axis>` does not: tools for robots write and read these files in the axes of the link.

use crate::xml::{DEPTH, Declarations, Element, parse_with};
use linkwork_spatial::nalgebra::Matrix4;
use linkwork_spatial::{Quat, Vec3};
use std::collections::BTreeMap;

/// Maximum number of corners of a file, so that instances of instances cannot fill the memory.
const CORNERS: usize = 30_000_000;

/// Returns the corners of the triangles, three for each.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Vec3>, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not a text file".to_string())?;
    let root = parse_with(text, "the mesh", Declarations::Allowed, DEPTH);
    let root = root.map_err(|e| e.to_string())?;
    if root.name != "COLLADA" {
        return Err(format!("its outermost element is <{}>, not <COLLADA>", root.name));
    }
    let unit = root.child("asset").and_then(|a| a.child("unit")).and_then(|u| u.attr("meter"));
    let unit = match unit.map(str::parse::<f64>) {
        None => 1.0,
        Some(Ok(u)) if u > 0.0 && u.is_finite() => u,
        Some(_) => return Err("the unit of length is not a positive number".into()),
    };
    let by_id = |list: &str, item: &str| -> BTreeMap<String, &Element> {
        let all = root.children.iter().filter(|c| c.name == list).flat_map(|l| &l.children);
        let items = all.filter(|e| e.name == item);
        items.filter_map(|e| Some((e.attr("id")?.to_owned(), e))).collect()
    };
    let mut file = File {
        geometries: by_id("library_geometries", "geometry"),
        nodes: by_id("library_nodes", "node"),
        controllers: by_id("library_controllers", "controller"),
        out: Vec::new(),
    };
    let scenes = by_id("library_visual_scenes", "visual_scene");
    let named = root.child("scene").and_then(|s| s.child("instance_visual_scene"));
    let named =
        named.and_then(|s| s.attr("url")).and_then(|u| scenes.get(u.trim_start_matches('#')));
    match named.or(scenes.values().next()) {
        Some(scene) => {
            for node in scene.children.iter().filter(|c| c.name == "node") {
                file.node(node, Matrix4::identity(), 0)?;
            }
        }
        None => {
            let all: Vec<&Element> = file.geometries.values().copied().collect();
            all.into_iter().try_for_each(|g| file.geometry(g, &Matrix4::identity()))?;
        }
    }
    if file.out.is_empty() {
        return Err("it has no triangles".into());
    }
    Ok(file.out.into_iter().map(|p| p * unit).collect())
}

struct File<'e> {
    geometries: BTreeMap<String, &'e Element>,
    nodes: BTreeMap<String, &'e Element>,
    controllers: BTreeMap<String, &'e Element>,
    out: Vec<Vec3>,
}

impl<'e> File<'e> {
    fn node(&mut self, e: &'e Element, outer: Matrix4<f64>, depth: usize) -> Result<(), String> {
        if depth > 100 {
            return Err("references between nodes are circular, or deeper than 100".into());
        }
        let mut X = outer;
        for c in &e.children {
            X *= transform(c)?;
        }
        for c in &e.children {
            let url = c.attr("url").unwrap_or_default().trim_start_matches('#');
            match c.name.as_str() {
                "node" => self.node(c, X, depth + 1)?,
                "instance_node" => {
                    let inner = self.nodes.get(url).copied();
                    self.node(inner.ok_or(format!("there is no node `{url}`"))?, X, depth + 1)?;
                }
                "instance_geometry" => {
                    let g = self.geometries.get(url).copied();
                    self.geometry(g.ok_or(format!("there is no geometry `{url}`"))?, &X)?;
                }
                "instance_controller" => {
                    // Use the original geometry of a skin, which is its bind pose.
                    let skin = self.controllers.get(url).and_then(|c| c.child("skin"));
                    let source = skin.and_then(|s| s.attr("source")).unwrap_or_default();
                    let g = self.geometries.get(source.trim_start_matches('#')).copied();
                    self.geometry(g.ok_or(format!("there is no geometry of `{url}`"))?, &X)?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn geometry(&mut self, e: &'e Element, X: &Matrix4<f64>) -> Result<(), String> {
        let Some(mesh) = e.child("mesh") else { return Ok(()) };
        let mut sources: BTreeMap<&str, Vec<Vec3>> = BTreeMap::new();
        for s in mesh.all("source") {
            if let Some(id) = s.attr("id") {
                sources.insert(id, points(s)?);
            }
        }
        let vertices = mesh.child("vertices");
        let position = vertices.and_then(|v| input(v, "POSITION"));
        let source = position.and_then(|p| p.attr("source")).unwrap_or_default();
        let points = sources.get(source.trim_start_matches('#'));
        let points = points.ok_or("a mesh does not have positions")?;
        for list in &mesh.children {
            let Some(faces) = faces(list)? else { continue };
            for face in faces {
                let corner = |k: usize| -> Result<Vec3, String> {
                    let p =
                        points.get(k).ok_or("a triangle refers to a vertex that does not exist")?;
                    Ok((X * p.push(1.0)).xyz())
                };
                let all = face.into_iter().map(corner).collect::<Result<Vec<Vec3>, String>>()?;
                for pair in all.get(1..).unwrap_or_default().windows(2) {
                    self.out.extend([all[0], pair[0], pair[1]]);
                }
                if self.out.len() > CORNERS {
                    return Err(format!("it has more than {CORNERS} corners"));
                }
            }
        }
        Ok(())
    }
}

/// Returns the input of an element with a semantic.
fn input<'e>(e: &'e Element, semantic: &str) -> Option<&'e Element> {
    e.children.iter().find(|i| i.name == "input" && i.attr("semantic") == Some(semantic))
}

fn numbers<T: std::str::FromStr>(text: &str, what: &str) -> Result<Vec<T>, String> {
    let one = |w: &str| w.parse::<T>().map_err(|_| format!("{what}: `{w}` is not a number"));
    text.split_whitespace().map(one).collect()
}

/// Returns the points of a `<source>`: three numbers of each stride.
fn points(source: &Element) -> Result<Vec<Vec3>, String> {
    let Some(array) = source.child("float_array") else { return Ok(Vec::new()) };
    let list: Vec<f64> = numbers(&array.text, "<float_array>")?;
    let accessor = source.child("technique_common").and_then(|t| t.child("accessor"));
    let whole = |name: &str, usual: usize| match accessor.and_then(|a| a.attr(name)) {
        Some(text) => text.parse::<usize>().map_err(|_| format!("`{name}` is `{text}`")),
        None => Ok(usual),
    };
    let (stride, offset) = (whole("stride", 3)?.max(1), whole("offset", 0)?);
    let inside = list.get(offset..).unwrap_or_default();
    let three = inside.chunks(stride).filter(|c| c.len() >= 3);
    Ok(three.map(|c| Vec3::new(c[0], c[1], c[2])).collect())
}

/// Returns the vertices of each face of a list of primitives, or `None` for other elements.
fn faces(list: &Element) -> Result<Option<Vec<Vec<usize>>>, String> {
    let lines = ["lines", "linestrips"].contains(&list.name.as_str());
    let kinds = ["triangles", "polylist", "polygons", "tristrips", "trifans"];
    if lines || !kinds.contains(&list.name.as_str()) {
        return Ok(None);
    }
    let Some(vertex) = input(list, "VERTEX") else { return Ok(None) };
    if list.child("ph").is_some() {
        return Err("polygons with holes (<ph>) are not supported".into());
    }
    let place = |i: &Element| i.attr("offset").map_or(Ok(0), |o| o.parse::<usize>());
    let places: Result<Vec<usize>, _> = list.all("input").map(place).collect();
    let places = places.map_err(|_| "an offset is not a number".to_string())?;
    let stride = places.into_iter().max().unwrap_or(0) + 1;
    let own = place(vertex).map_err(|_| "an offset is not a number".to_string())?;
    let mut polygons = Vec::new();
    for p in list.all("p") {
        let all: Vec<usize> = numbers(&p.text, "<p>")?;
        polygons.push(all.chunks_exact(stride).map(|c| c[own]).collect::<Vec<usize>>());
    }
    let faces = match list.name.as_str() {
        "triangles" => {
            polygons.iter().flat_map(|p| p.chunks_exact(3).map(<[usize]>::to_vec)).collect()
        }
        "polylist" => {
            let counts: Vec<usize> = match list.child_text("vcount") {
                Some((_, text)) => numbers(text, "<vcount>")?,
                None => return Err("a <polylist> lacks <vcount>".into()),
            };
            let (all, mut at, mut out) = (polygons.concat(), 0_usize, Vec::new());
            for n in counts {
                let face = at.checked_add(n).and_then(|end| all.get(at..end));
                out.push(face.ok_or("<vcount> counts more vertices than the mesh has")?.to_vec());
                at += n;
            }
            out
        }
        // Every second triangle of a strip has the opposite orientation.
        "tristrips" => (polygons.iter())
            .flat_map(|p| p.windows(3).enumerate())
            .map(|(k, w)| if k % 2 == 0 { vec![w[0], w[1], w[2]] } else { vec![w[1], w[0], w[2]] })
            .collect(),
        _ => polygons,
    };
    Ok(Some(faces))
}

/// Returns a transformation of a node, or the identity for other elements.
fn transform(e: &Element) -> Result<Matrix4<f64>, String> {
    if ["lookat", "skew"].contains(&e.name.as_str()) {
        return Err(format!("the transformation <{}> of a node is not supported", e.name));
    }
    let kinds = [("matrix", 16), ("translate", 3), ("rotate", 4), ("scale", 3)];
    let Some((_, count)) = kinds.iter().find(|(name, _)| *name == e.name) else {
        return Ok(Matrix4::identity());
    };
    let n: Vec<f64> = numbers(&e.text, &format!("<{}>", e.name))?;
    if n.len() != *count {
        return Err(format!("<{}> has {} numbers, not {count}", e.name, n.len()));
    }
    Ok(match e.name.as_str() {
        "matrix" => Matrix4::from_row_slice(&n),
        "translate" => Matrix4::new_translation(&Vec3::new(n[0], n[1], n[2])),
        "scale" => Matrix4::new_nonuniform_scaling(&Vec3::new(n[0], n[1], n[2])),
        _ => {
            let axis = Vec3::new(n[0], n[1], n[2]);
            let axis = axis.try_normalize(1e-100).unwrap_or_else(Vec3::z);
            Quat::from_scaled_axis(axis * n[3].to_radians()).to_homogeneous()
        }
    })
}
