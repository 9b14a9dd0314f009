//! SRDF: groups, pairs that do not collide, and errors in a file.

use linkwork_formats::{Group, ReadOptions, read_srdf, read_srdf_file};

#[test]
fn groups_and_pairs_are_read_and_the_rest_is_listed() {
    let text = r#"<robot name="two">
  <group name="arm"><chain base_link="base" tip_link="tool"/></group>
  <group name="hand"><link name="palm"/><joint name="finger_a"/><joint name="finger_b"/></group>
  <group name="all"><group name="arm"/></group>
  <disable_collisions link1="base" link2="shoulder" reason="Adjacent"/>
  <end_effector name="eef" parent_link="tool" group="hand"/>
</robot>"#;
    let srdf = read_srdf(text, &ReadOptions::default()).unwrap();
    let group = |name: &str, chains: &[[&str; 2]], links: &[&str], joints: &[&str]| Group {
        name: name.into(),
        chains: chains.iter().map(|c| c.map(str::to_owned)).collect(),
        links: links.iter().map(|s| (*s).to_owned()).collect(),
        joints: joints.iter().map(|s| (*s).to_owned()).collect(),
    };
    assert_eq!(srdf.name, "two");
    assert_eq!(
        srdf.groups,
        [
            group("arm", &[["base", "tool"]], &[], &[]),
            group("hand", &[], &["palm"], &["finger_a", "finger_b"]),
            group("all", &[], &[], &[]),
        ]
    );
    assert_eq!(srdf.ignore, [["base".to_owned(), "shoulder".to_owned()]]);
    let ignored: Vec<String> = srdf.ignored.iter().map(ToString::to_string).collect();
    assert_eq!(ignored.len(), 2, "{ignored:?}");
    assert!(ignored[0].starts_with("<text>:4: robot/group[all]/group[arm]"), "{ignored:?}");
    assert!(ignored[1].contains("element <end_effector>"), "{ignored:?}");
}

#[test]
fn mistakes_have_places() {
    let text = "<robot>\n<group name=\"arm\"/>\n<group name=\"arm\"/>\n<group/>\n\
                <group name=\"leg\"><chain base_link=\"base\"/></group>\n</robot>";
    let error = read_srdf(text, &ReadOptions::default()).unwrap_err().to_string();
    for needle in ["<text>:3:8", "<text>:4:1", "<text>:5:", "`tip_link`", "defined again"] {
        assert!(error.contains(needle), "{needle}: {error}");
    }
    let error = read_srdf("<urdf/>", &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("an SRDF file is <robot"), "{error}");
    let error = read_srdf_file("nowhere.srdf").unwrap_err().to_string();
    assert!(error.starts_with("nowhere.srdf"), "{error}");
}
