//! Memory of long chains is proportional to their length: four times the bodies need four times the memory, not sixteen times.

use linkwork_embedded::dynamics::{Tree, Workspace};
use linkwork_embedded::formats::{ReadOptions, Root, read_text};
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use std::fmt::Write;

fn link() -> MassProperties {
    MassProperties::new(0.1, Vec3::new(0.05, 0.0, 0.0), Mat3::identity() * 1e-3)
}

fn chain(n: usize) -> Builder {
    let mut b = Builder::new();
    for k in 0..n {
        let parent = if k == 0 { "world".to_string() } else { format!("link {}", k - 1) };
        let hinge = Hinge::pin(Vec3::ith(k % 3, 1.0));
        let body = BodySpec::new(format!("link {k}"), parent).hinge(hinge).mass(link());
        b.body(body.hinge_in_parent(Pose::translation(0.1, 0.0, 0.0)));
    }
    b
}

fn urdf(n: usize) -> String {
    let mut text = String::from("<robot name=\"chain\"><link name=\"l0\"/>\n");
    for k in 1..n {
        let _ = writeln!(
            text,
            r#"<link name="l{k}"><inertial><origin xyz="0.05 0 0"/><mass value="0.1"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j{k}" type="continuous"><parent link="l{}"/><child link="l{k}"/><origin xyz="0.1 0 0"/><axis xyz="0 0 1"/></joint>"#,
            k - 1
        );
    }
    text + "</robot>"
}

/// Compares bytes and blocks for sizes `n` and `4 n`.
fn grows(what: &str, n: usize, make: impl Fn(usize)) {
    let [(bytes, blocks), (more, many)] = [n, 4 * n].map(|n| {
        let counted = allocation_counter::measure(|| make(n));
        (counted.bytes_total as f64, counted.count_total as f64)
    });
    let (bytes, blocks) = (more / bytes, many / blocks);
    println!("{what}, {n} to {}: {bytes:.2} times the bytes, {blocks:.2} times the blocks", 4 * n);
    // The growth may exceed a factor of four, because lists double their capacity and paths in
    // trees get longer.
    assert!(bytes < 5.0 && blocks < 5.0, "{what}: {bytes} {blocks}");
}

#[test]
fn a_chain_of_twenty_thousand_bodies_is_built_in_linear_memory() {
    grows("a mechanism and its tree", 5000, |n| {
        let multibody = chain(n).build().unwrap();
        let tree = Tree::new(&multibody);
        let ws = Workspace::new(&tree);
        assert_eq!((multibody.bodies().len(), tree.nv()), (n, n));
        drop(ws);
    });
}

#[test]
fn a_file_of_four_thousand_links_is_read_in_linear_memory() {
    let texts = [1000, 4000].map(|n| (n, urdf(n)));
    let options = ReadOptions { root: Root::Fixed, ..ReadOptions::default() };
    grows("a URDF file", 1000, |n| {
        let text = &texts.iter().find(|t| t.0 == n).unwrap().1;
        let d = read_text(text, &options).unwrap();
        let multibody = d.builder.build().unwrap();
        assert_eq!((multibody.nv(), d.joints.len()), (n - 1, n - 1));
    });
}
