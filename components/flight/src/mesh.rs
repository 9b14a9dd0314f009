//! Files as parameters: surface meshes from Wavefront OBJ files, whose facets are used as panels.
//!
//! A closed mesh is the whole surface of a body, and is checked for gaps. An open mesh is a part of a surface, such as the front of a heat shield
//! without its base; only the side of its normals is exposed.

use linkwork_runtime::{Located, Param, ParamSpec, ReadCx, Value};
use linkwork_surroundings::prelude::*;
use linkwork_world::error::WorldError;
use linkwork_world::gravity::polyhedron::{Facet, Surface, facets_from_obj};
use std::sync::Arc;

/// Returns name and text of a file that a parameter names, or that it contains as `(name: "..", text: "..")`. `example` is a file name for the help text.
pub(crate) fn named_text(
    v: &Located,
    spec: &ParamSpec,
    cx: &mut ReadCx<'_>,
    example: &str,
) -> Option<(String, String)> {
    let at = format!("`{}.{}`", cx.path, spec.name);
    let word = |key: &str| match v.get(key).map(|l| &l.value) {
        Some(Value::Text(t)) => Some(t.clone()),
        _ => None,
    };
    let (fact, help) = match &v.value {
        Value::Text(name) => return Some((name.clone(), cx.text(name, v.origin)?)),
        Value::Map(_) => match (word("name"), word("text")) {
            (Some(name), Some(text)) => return Some((name, text)),
            _ => {
                let help = r#"write (name: "..", text: "..")"#.to_string();
                (format!("{at}: `name` or `text` is missing"), help)
            }
        },
        other => {
            let fact = format!("{at} must be the name of a file, but it is {}", other.what());
            (fact, format!("write e.g. \"{example}\""))
        }
    };
    cx.fault(v.origin, fact, Some(help));
    None
}

/// Returns the value of a parameter of [`named_text`] for display.
pub(crate) fn show_text(name: &str, text: &str) -> Value {
    Value::Map(vec![
        ("name".into(), Value::Text(name.into()).into()),
        ("text".into(), Value::Text(text.into()).into()),
    ])
}

/// Wavefront OBJ file as a parameter: its name, or `(name: "..", text: "..")` with the content of the file.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// Name for messages.
    pub name: String,
    /// Text of the file; parsed when the model is built.
    pub text: Arc<str>,
}

impl Param for MeshFile {
    fn kind() -> String {
        r#"name of a Wavefront OBJ file, or (name: "..", text: "..") with its content"#.into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<MeshFile> {
        let (name, text) = named_text(v, spec, cx, "bus.obj")?;
        Some(MeshFile { name, text: text.into() })
    }
    fn show(&self) -> Value {
        show_text(&self.name, &self.text)
    }
}

/// Kind of surface of a mesh.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshSurface {
    /// Whole surface of a body without gaps, with outward normals.
    Closed,
    /// Part of a surface; adjacent facets have the same orientation.
    Open,
}

/// Surface mesh of a body.
#[derive(Params, Clone, Debug)]
pub struct MeshParams {
    /// Wavefront OBJ file (lines `v` and `f`), corners counter-clockwise seen from outside, body axes.
    pub file: MeshFile,
    /// Length of one unit of the file.
    #[param(unit = "m", default = 1.0, range = 1e-9..)]
    pub scale: f64,
    /// Position of the file's origin relative to the node, body axes.
    #[param(unit = "m", default = Vec3::zeros())]
    pub origin: Vec3,
    /// Kind of surface: closed, open.
    #[param(default = MeshSurface::Closed)]
    pub surface: MeshSurface,
}

impl MeshParams {
    /// Returns the facets; centres relative to the node, m, body axes.
    ///
    /// # Errors
    /// All errors of [`facets_from_obj`], for the parameter `mesh`.
    pub fn facets(&self) -> Result<Vec<Facet>, BuildError> {
        let surface = match self.surface {
            MeshSurface::Closed => Surface::Closed,
            MeshSurface::Open => Surface::Open,
        };
        let read = facets_from_obj(&self.file.name, &self.file.text, self.scale, surface);
        let mut facets = read.map_err(|e| {
            let (fact, help) = match &e {
                WorldError::Mesh { place, fact, help } => (format!("{place}: {fact}"), *help),
                other => (other.to_string(), "repair the mesh"),
            };
            let help = match surface {
                Surface::Closed => format!("{help}; write `surface: open` if the gap is intended"),
                Surface::Open => help.to_string(),
            };
            BuildError::new(fact).help(help).at("mesh")
        })?;
        facets.iter_mut().for_each(|f| f.centre += self.origin);
        Ok(facets)
    }
}

/// Checks that a body has panels, from the file or from a mesh.
///
/// # Errors
/// The body has no panels.
pub(crate) fn some_panels(count: usize) -> Result<(), BuildError> {
    if count > 0 {
        return Ok(());
    }
    Err(BuildError::new("neither `panels` nor `mesh` is written, so the body has no surface")
        .help("write `panels: [(area: 1, normal: [1, 0, 0])]`, or `mesh: (file: \"bus.obj\")`")
        .at("panels"))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Cube with edges of 2 m, centred at the origin.
    pub(crate) const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
        f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

    pub(crate) fn mesh(text: &str) -> MeshParams {
        let file = MeshFile { name: "cube.obj".into(), text: text.into() };
        MeshParams { file, scale: 1.0, origin: Vec3::zeros(), surface: MeshSurface::Closed }
    }

    #[test]
    fn a_mesh_stands_where_its_origin_is_and_what_is_none_is_refused() {
        let origin = Vec3::new(3.0, 0.5, -1.0);
        let facets = MeshParams { scale: 0.5, origin, ..mesh(CUBE) }.facets().unwrap();
        let area: f64 = facets.iter().map(|f| f.area).sum();
        let middle: Vec3 = facets.iter().map(|f| f.centre * f.area).sum();
        assert!(facets.len() == 12 && (area - 6.0).abs() < 1e-14);
        assert!((middle / area - origin).norm() < 1e-14);

        let open = CUBE.replace("f 4 1 5 8\n", "");
        let thin = CUBE.replace("f 4 1 5 8", "f 4 4 5 8");
        for (text, fact) in [
            ("", "cube.obj: has no face"),
            ("v 1 2\n", "cube.obj:1: a vertex without three numbers"),
            (&thin, "cube.obj:14: has no area"),
            (&open, "cube.obj: edge"),
        ] {
            let e = mesh(text).facets().unwrap_err();
            assert!(e.message.starts_with(fact), "{}", e.message);
            assert!(e.param.as_deref() == Some("mesh") && e.help.is_some());
        }
        assert!(mesh(&open).facets().unwrap_err().help.unwrap().contains("`surface: open`"));
        let part = MeshParams { surface: MeshSurface::Open, ..mesh(&open) };
        assert_eq!(part.facets().unwrap().len(), 10);
        assert!(some_panels(0).is_err() && some_panels(1).is_ok());
    }

    #[test]
    fn a_parameter_is_a_file_or_a_text_in_place() {
        use linkwork_runtime::{Fault, Services};
        let services = Services::default();
        let spec = <MeshParams as linkwork_runtime::Params>::specs()
            .into_iter()
            .find(|s| s.name == "file")
            .unwrap();
        let read = |v: Value| {
            let mut cx = ReadCx::new("Craft", &services);
            let file = MeshFile::read(&v.into(), &spec, &mut cx);
            let told = |f: &Fault| f.message.clone();
            (file.map(|f| f.text.to_string()), cx.faults.iter().map(told).collect::<String>())
        };
        assert_eq!(read(show_text("cube.obj", CUBE)), (Some(CUBE.into()), String::new()));
        for (value, fact) in [
            (Value::Text("gone.obj".into()), "gone.obj"),
            (Value::Number(1.0), "`Craft.file` must be the name of a file"),
            (Value::Map(vec![]), "`name` or `text` is missing"),
        ] {
            let (file, told) = read(value);
            assert!(file.is_none() && told.contains(fact), "{told}");
        }
    }
}
