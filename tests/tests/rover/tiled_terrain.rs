//! Tiled terrain under mechanisms: bit-identical with a single array, runs that stop at a damaged tile, regions for bodies and cameras, and checks of
//! files that test every tile.
use linkwork_environment::height_field::HeightField;
use linkwork_environment::map_file::{OpenMap, open_map, write_map};
use linkwork_runtime::{Seconds, Simulation};
use std::path::{Path, PathBuf};

use crate::common;

/// A folder with a map of 60 m × 40 m that descends to the east, as GeoTIFF and as tiles of 8 m.
struct Maps(PathBuf);

impl Drop for Maps {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Maps {
    fn new(name: &str) -> Maps {
        let folder =
            std::env::temp_dir().join(format!("linkwork_tiles_{name}_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (nx, ny) = (121, 81);
        let height = |k: usize| {
            let (x, y) = (0.5 * (k % nx) as f64, 0.5 * (k / nx) as f64);
            (-0.12 * x + 0.05 * (1.3 * x).sin() + 0.04 * (0.9 * y + 0.4 * x).cos()) as f32
        };
        let heights = (0..nx * ny).map(height).collect();
        let field = HeightField::new([0.0; 2], [0.5; 2], nx, ny, heights).unwrap();
        for file in ["map.tif", "map.tiles"] {
            write_map(&folder.join(file), &mut OpenMap::Whole(field.clone()), 16).unwrap();
        }
        Maps(folder)
    }

    fn path(&self, file: &str) -> String {
        self.0.join(file).display().to_string()
    }

    /// The heights, in memory and centred.
    fn field(&self) -> HeightField {
        let open = open_map(Path::new(&self.path("map.tif")), &Default::default()).unwrap();
        match open.anywhere().unwrap() {
            OpenMap::Whole(field) => field.centred(),
            _ => panic!("it is held as a whole"),
        }
    }

    fn damage(&self, tile: usize) {
        damage(&self.0.join("map.tiles"), tile);
    }
}

/// Changes a bit of a tile; its index entry gives the position.
fn damage(path: &Path, tile: usize) {
    let mut bytes = std::fs::read(path).unwrap();
    let entry = 112 + 16 * tile;
    let start = u64::from_le_bytes(bytes[entry..entry + 8].try_into().unwrap()) as usize;
    bytes[start + 5] ^= 8;
    std::fs::write(path, bytes).unwrap();
}

/// A cart of four wheels that rolls down the map.
fn cart(model: &str, params: &str) -> String {
    let wheels = [("fl", 0.8, 0.6), ("fr", 0.8, -0.6), ("rl", -0.8, 0.6), ("rr", -0.8, -0.6)];
    let bodies: String = wheels.map(|(name, x, y)| format!(
        r#""{name}": (parent: "cart", at: (position: [{x}, {y}, -0.1]), hinge: Pin([0, 1, 0]), mass: 5, inertia: Cylinder(radius: 0.25, length: 0.1, axis: [0, 1, 0])),"#
    )).concat();
    let contacts: String = wheels.map(|(name, ..)| format!(
        r#""Contact_{name}": (model: "mobility.wheel_rigid", params: {{ "radius": 0.25, "width": 0.1 }}, bind: {{ "hub": "node:{name}" }}),"#
    )).concat();
    format!(
        r#"Simulation(
            bodies: {{ "cart": (parent: "world", hinge: Free, mass: 60, inertia: Box([2, 1, 0.5])), {bodies} }},
            parts: {{
                "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -3.72] }}),
                "Ground": (model: "{model}", params: {{ "soil": {{ "kind": "lunar" }}, {params} }}),
                {contacts}
            }},
            step: "1 ms", integrator: "semi_implicit_euler", until: "12 s",
            place: (body: "cart", at: [-20, 1], wheels: ["fl", "fr", "rl", "rr"], radius: "0.25 m"),
        )"#
    )
}

fn tiled(maps: &Maps, more: &str) -> String {
    cart("environment.tiled_terrain", &format!("\"file\": \"{}\", {more}", maps.path("map.tiles")))
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
}

fn bits(sim: &Simulation) -> Vec<u64> {
    let state =
        ["position.x", "position.y", "position.z", "velocity.x", "velocity.y", "velocity.z"];
    state.iter().map(|s| sim.get(&format!("cart.{s}")).unwrap().to_bits()).collect()
}

#[test]
fn a_cart_rolls_as_on_one_array_whatever_is_kept_and_however_the_run_is_cut() {
    let maps = Maps::new("cart");
    let whole =
        cart("environment.height_field", &format!("\"file\": \"{}\"", maps.path("map.tif")));
    let mut straight = common::scene(&whole, &[]).unwrap();
    until(&mut straight, 9.0);
    let x = straight.get("cart.position.x").unwrap();
    println!("it has rolled to x = {x} m");
    assert!(x > -8.0, "from one tile over the next to a third: {x}");
    for more in ["\"kept\": 1", "\"kept\": 3", ""] {
        let mut sim = common::scene(&tiled(&maps, more), &[]).unwrap();
        until(&mut sim, 9.0);
        assert_eq!(bits(&sim), bits(&straight), "{more}");
    }
    let mut cut = common::scene(&tiled(&maps, "\"kept\": 1"), &[]).unwrap();
    for k in 1..=9 {
        until(&mut cut, f64::from(k));
        cut = cut.fork();
    }
    assert_eq!(bits(&cut), bits(&straight));
}

#[test]
fn a_damaged_tile_stops_the_run_with_its_place_and_the_remedy() {
    let maps = Maps::new("damage");
    let text = tiled(&maps, "");
    // The map has tiles of 16 cells, eight across. It is centred: x begins at -30 m, tile 2 at -14
    // m.
    maps.damage(2 * 8 + 2);
    let mut sim = common::scene(&text, &[]).unwrap();
    let error = sim.run_until(Seconds::from_decimal(12.0).unwrap()).unwrap_err();
    let x = sim.get("cart.position.x").unwrap();
    println!("x = {x}: {error}");
    assert!(error.time > 1.0 && (x + 15.05).abs() < 0.3, "where its front wheels come there: {x}");
    assert_eq!(error.path, "Ground");
    let told = error.to_string();
    assert!(
        told.contains("map.tiles`: tile 2, 2 (from the south-west): its checksum is wrong"),
        "{told}"
    );
    assert!(error.help.unwrap().contains("linkwork terrain convert"));
    // Further steps give the same error.
    assert!(sim.step().is_err());
    // Damage under the start of the mechanism is reported before the run.
    maps.damage(2 * 8 + 1);
    let told = common::scene(&text, &[]).err().unwrap();
    assert!(told.contains("tile 1, 2") && told.contains("linkwork terrain convert"), "{told}");
    // Damage at the origin, whose height is read for z = 0, is reported at the file, and only then.
    let origin = Maps::new("origin");
    origin.damage(2 * 8 + 3);
    let told = common::scene(&tiled(&origin, ""), &[]).err().unwrap();
    assert!(told.contains("Ground.file") && told.contains("tile 3, 2"), "{told}");
    assert!(common::scene(&tiled(&origin, "\"level\": false"), &[]).is_ok());
}

/// Beyond the edge and in gaps there is no ground: a body that rolls there falls, and the run continues.
#[test]
fn over_an_edge_a_cart_falls() {
    let maps = Maps::new("edge");
    // The map ends a metre before the cart.
    let mut field = maps.field();
    field.map_within([-17.0, -20.0, 30.0, 20.0], |_, _, _| f64::NAN);
    write_map(Path::new(&maps.path("map.tiles")), &mut OpenMap::Whole(field), 16).unwrap();
    let mut sim = common::scene(&tiled(&maps, "\"level\": false"), &[]).unwrap();
    until(&mut sim, 1.0);
    let start = sim.get("cart.position.z").unwrap();
    assert!(sim.get("Contact_fl.normal_force").unwrap() > 20.0);
    until(&mut sim, 9.0);
    let (z, force) =
        (sim.get("cart.position.z").unwrap(), sim.get("Contact_fl.normal_force").unwrap());
    println!("from z = {start} to {z} m");
    assert!(z < start - 20.0 && force == 0.0, "{z} {force}");
}

#[test]
fn bodies_meet_a_region_and_are_refused_without_one() {
    let maps = Maps::new("region");
    let text = |model: &str, params: &str| {
        format!(
            r#"Simulation(
                bodies: {{ "crate": (parent: "world", hinge: Free, mass: 20, inertia: Box([1, 0.8, 0.4]), initial: (position: [3, -2, 1]),
                    shapes: [(shape: Box([1, 0.8, 0.4]), collide: true, name: "hull")]) }},
                parts: {{
                    "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                    "Ground": (model: "{model}", params: {{ "soil": {{ "kind": "lunar" }}, {params} }}),
                }},
                contact: (), step: "1 ms", until: "10 s")"#
        )
    };
    let whole =
        text("environment.height_field", &format!("\"file\": \"{}\"", maps.path("map.tif")));
    let tiles = format!("\"file\": \"{}\"", maps.path("map.tiles"));
    let told = common::scene(&text("environment.tiled_terrain", &tiles), &[]).err().unwrap();
    assert!(told.contains("the map of 121 by 81 nodes is not loaded as a whole"), "{told}");
    assert!(told.contains("write `region: (x_min, y_min, x_max, y_max)`"), "{told}");
    let region = format!("{tiles}, \"region\": [-6, -8, 12, 6]");
    let rest = |text: &str| {
        let mut sim = common::scene(text, &[]).unwrap();
        until(&mut sim, 3.0);
        ["x", "y", "z"].map(|a| sim.get(&format!("crate.position.{a}")).unwrap())
    };
    let (a, b) = (rest(&whole), rest(&text("environment.tiled_terrain", &region)));
    println!("on the array {a:?}, on the region {b:?}");
    // The grids start elsewhere, so round-off differs.
    assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-6), "{a:?} {b:?}");
    let wide = format!("{tiles}, \"region\": [-60, -8, 12, 6]");
    let told = common::scene(&text("environment.tiled_terrain", &wide), &[]).err().unwrap();
    assert!(
        told.contains("is not on the map") && told.contains("the map extends over [-30.0, -20.0"),
        "{told}"
    );
}

#[test]
fn a_plan_knows_every_tile() {
    let maps = Maps::new("hash");
    let text = tiled(&maps, "");
    let hash = || common::scene(&text, &[]).unwrap().plan().hash();
    let before = hash();
    assert_eq!(before, hash());
    // A tile far from the mechanism is rewritten with another height.
    let mut field = maps.field();
    let [.., x1, y1] = field.bounds();
    field.map_around(x1, y1, 0.1, |_, h| h + 0.01);
    write_map(Path::new(&maps.path("map.tiles")), &mut OpenMap::Whole(field), 16).unwrap();
    assert_ne!(before, hash());
}
