//! Services that several compilations share: they are those that the files of today ask for.
use crate::common::*;
use linkwork_runtime::*;
use linkwork_spatial::Vec3;
use linkwork_surroundings::PlainWorld;
use linkwork_surroundings::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// A world from a file.
#[derive(Params, Clone, Debug)]
pub struct FromFile {
    /// File with the gravity parameter.
    file: String,
}
pub struct FileWorld(f64);
impl Service for FileWorld {
    const NAME: &'static str = "t.file_world";
    const DOC: &'static str = "A world whose gravity parameter stands in a file.";
    type Provides = dyn World;
    type Params = FromFile;
    fn build(p: FromFile, files: &Files) -> Result<Self, BuildError> {
        let text = files.text(&p.file)?;
        text.trim().parse().map(FileWorld).map_err(|e| BuildError::of(&e))
    }
    fn object(self) -> ServiceObject {
        ServiceObject::new::<dyn World>(Arc::new(PlainWorld::inertial(self.0, 1e6, 0.0)))
    }
}
/// The world.
#[derive(Params, Clone, Debug)]
pub struct OfWorld {
    /// The world.
    #[param(service)]
    world: Handle<dyn World>,
}
pub struct Pull(f64);
impl linkwork_surroundings::Gravity for Pull {
    fn acceleration(&self, _: f64, p: Vec3) -> Vec3 {
        p * (-self.0 / p.norm().powi(3))
    }
}
impl Service for Pull {
    const NAME: &'static str = "t.pull";
    const DOC: &'static str = "Gravity of the world.";
    type Provides = dyn Gravity;
    type Params = OfWorld;
    fn build(p: OfWorld, _: &Files) -> Result<Self, BuildError> {
        Ok(Pull(p.world.mu().unwrap_or(0.0)))
    }
    fn object(self) -> ServiceObject {
        ServiceObject::new::<dyn Gravity>(Arc::new(self))
    }
}

fn service(path: &str, model: &str, params: &[(&str, &str)]) -> PartSpec {
    let text = |(k, v): &(&str, &str)| (k.to_string(), Value::Text((*v).into()).into());
    let params = Value::Map(params.iter().map(text).collect()).into();
    PartSpec { params, ..part(path, model, &[], None) }
}

/// Gravity is made again when a file of the world has changed, although its own words are the same.
#[test]
fn a_changed_file_of_the_world_changes_what_depends_on_it() {
    let mut all = catalogue();
    all.add(Entry::service::<FileWorld>()).unwrap();
    all.add(Entry::service::<Pull>()).unwrap();
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let name = "shared_world.txt";
    let parts = vec![
        service("world", "t.file_world", &[("file", name)]),
        service("gravity", "t.pull", &[]),
        part("y", "t.integrator", &[], None),
    ];
    let spec = spec(parts, &[]);
    let made = Arc::new(ServiceCache::default());
    let pull = |mu: &str| {
        std::fs::write(folder.join(name), mu).unwrap();
        let files = Files::of(vec![folder.clone()]).sharing(made.clone());
        let plan = compile(&spec, &all, &files).unwrap_or_else(|e| panic!("{e}"));
        let gravity = plan.services.iter().find_map(|(_, o)| o.get::<dyn Gravity>().cloned());
        let gravity = gravity.unwrap();
        (-gravity.acceleration(0.0, Vec3::x()).x, Arc::as_ptr(&gravity).cast::<()>())
    };
    let (first, same) = (pull("4.9e12"), pull("4.9e12"));
    assert_eq!(first, same, "nothing has changed: it is the one of before");
    assert_eq!((first.0, pull("4.3e13").0), (4.9e12, 4.3e13));
}
