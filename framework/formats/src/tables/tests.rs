//! Compares every line of the tables with the readers: an attribute marked as equal is read and changes the mechanism, an ignored one is listed, a
//! rejected one is an error; unknown names are reported.

mod templates;

use super::{Row, Status, of};
use crate::{Description, Format, ReadOptions, read_text};
use templates::{MJCF, SILENT, Template, WITH};

macro_rules! INERTIAL {
    ($a:expr, $b:expr, $c:expr) => {
        concat!(r#"<robot version="1.1"><link name="a"/><link name="b"><inertial>"#, $a, $b, $c, r#"</inertial></link><joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"#)
    };
}
macro_rules! SHAPE {
    ($a:expr) => {
        concat!(
            r#"<robot version="1.1"><link name="a"><collision><geometry>"#,
            $a,
            r#"</geometry></collision></link></robot>"#
        )
    };
}
macro_rules! JOINT {
    ($attributes:expr, $inside:expr) => {
        concat!(r#"<robot version="1.1"><link name="a"/><link name="b"/><link name="c"/><link name="d"/><joint name="i" type="continuous"><parent link="a"/><child link="c"/></joint><joint name="k" type="continuous"><parent link="a"/><child link="d"/></joint><joint "#, $attributes, r#" name="n" type="revolute"><parent link="a"/><child link="b"/>"#, $inside, "</joint></robot>")
    };
}

const URDF: &[Template] = &[
    ("robot", r#"<robot @><link name="a"/>#</robot>"#),
    (
        "robot/material",
        r#"<robot><material @ name="n"><color rgba="1 0 0 1"/>#</material><link name="a"><visual><geometry><sphere radius="1"/></geometry><material name="m"/></visual></link></robot>"#,
    ),
    (
        "material/color",
        r#"<robot version="1.1"><link name="a"><visual><geometry><sphere radius="1"/></geometry><material><color @/></material></visual></link></robot>"#,
    ),
    (
        "robot/link",
        r#"<robot version="1.1"><link @ name="a"><visual><geometry><sphere radius="1"/></geometry></visual>#</link></robot>"#,
    ),
    (
        "inertial/origin",
        INERTIAL!(
            "<origin @/>",
            r#"<mass value="1"/>"#,
            r#"<inertia ixx="1" iyy="1.1" izz="1.2" ixy="0" ixz="0" iyz="0"/>"#
        ),
    ),
    (
        "inertial/mass",
        INERTIAL!(
            "",
            "<mass @/>",
            r#"<inertia ixx="1" iyy="1.1" izz="1.2" ixy="0" ixz="0" iyz="0"/>"#
        ),
    ),
    (
        "inertial/inertia",
        INERTIAL!(
            "",
            r#"<mass value="1"/>"#,
            r#"<inertia @ ixx="1" iyy="1.1" izz="1.2" ixy="0" ixz="0" iyz="0"/>"#
        ),
    ),
    (
        "link/visual",
        r#"<robot version="1.1"><link name="a"><visual @><geometry><sphere radius="1"/></geometry>#</visual></link></robot>"#,
    ),
    (
        "link/collision",
        r#"<robot version="1.1"><link name="a"><collision @><geometry><sphere radius="1"/></geometry>#</collision></link></robot>"#,
    ),
    (
        "visual/origin",
        r#"<robot version="1.1"><link name="a"><visual><origin @/><geometry><sphere radius="1"/></geometry></visual></link></robot>"#,
    ),
    (
        "collision/origin",
        r#"<robot version="1.1"><link name="a"><collision><origin @/><geometry><sphere radius="1"/></geometry></collision></link></robot>"#,
    ),
    (
        "visual/material",
        r#"<robot><material name="m"><color rgba="1 0 0 1"/></material><link name="a"><visual><geometry><sphere radius="1"/></geometry><material @/></visual></link></robot>"#,
    ),
    (
        "collision/material",
        r#"<robot><material name="m"><color rgba="1 0 0 1"/></material><link name="a"><collision><geometry><sphere radius="1"/></geometry><material @/></collision></link></robot>"#,
    ),
    ("geometry/box", SHAPE!(r#"<box @ size="3 3 3"/>"#)),
    ("geometry/sphere", SHAPE!(r#"<sphere @ radius="3"/>"#)),
    ("geometry/cylinder", SHAPE!(r#"<cylinder @ radius="3" length="3"/>"#)),
    ("geometry/capsule", SHAPE!(r#"<capsule @ radius="3" length="3"/>"#)),
    ("geometry/mesh", SHAPE!(r#"<mesh @ filename="b.stl"/>"#)),
    ("robot/joint", JOINT!("@", "#")),
    ("joint/origin", JOINT!("", "<origin @/>")),
    ("joint/axis", JOINT!("", "<axis @/>")),
    ("joint/dynamics", JOINT!("", "<dynamics @/>")),
    ("joint/limit", JOINT!("", r#"<limit @ lower="-1" upper="1" effort="1" velocity="1"/>"#)),
    ("joint/mimic", JOINT!("", r#"<mimic @ joint="k"/>"#)),
    (
        "robot/gazebo",
        r#"<robot version="1.1"><link name="l"><collision><geometry><sphere radius="1"/></geometry></collision></link><gazebo @><mu1>0.4</mu1></gazebo></robot>"#,
    ),
];

const URDF_SILENT: &[&str] = &["robot version", "collision/material name"];

fn read(text: &str) -> Result<Description, String> {
    let mut options = ReadOptions::default();
    if text.contains("<key ") {
        options.keyframe = Some(if text.contains("name=") { "n" } else { "0" }.into());
    }
    read_text(text, &options).map_err(|e| e.to_string())
}

/// Returns the template with some attributes replaced.
fn with(template: &str, attributes: &str, inside: &str) -> String {
    let Some((before, after)) = template.split_once('@') else { panic!("no @ in {template}") };
    let end = after.find('>').unwrap_or(0);
    let (own, rest) = (&after[..end], &after[end..]);
    let slash = if own.ends_with('/') { "/" } else { "" };
    let mut own = own.trim_end_matches('/').to_owned();
    for one in super::pieces(attributes) {
        let name = one.split('=').next().unwrap_or_default();
        let kept: Vec<&str> = (super::pieces(&own).into_iter())
            .filter(|w| w.split('=').next() != Some(name))
            .collect();
        own = kept.join(" ");
    }
    format!("{before} {attributes} {own}{slash}{rest}").replace('#', inside)
}

/// Returns the contents of a description without its lists of unused elements.
fn content(mut d: Description) -> Description {
    d.ignored.clear();
    d.doubtful.clear();
    d
}

/// Tests every attribute of a row; returns the faults in words.
fn attributes(key: &str, row: &Row, template: &str, silent: &[&str]) -> Vec<String> {
    let mut wrong = Vec::new();
    let also = |name: &str| {
        let place = format!("{key} {name}");
        WITH.iter().find(|(k, _)| *k == place).map_or("", |(_, more)| more)
    };
    for (name, (status, value)) in &row.attributes {
        let Some(value) = value.as_deref().or((*status != Status::Equal).then_some("1")) else {
            continue;
        };
        let (own, more) = (format!("{name}=\"{value}\""), also(name));
        let text = with(template, &format!("{own} {more}"), "");
        let base = read(&with(template, more, ""));
        let place = format!("{key} {name}");
        let mut say = |what: String| wrong.push(format!("{place}: {what}\n    {text}"));
        match (status, read(&text)) {
            (Status::Rejected, Ok(_)) => say("is accepted".into()),
            (Status::Rejected, Err(_)) => {}
            (_, Err(why)) => say(format!("is rejected: {why}")),
            (Status::Ignored, Ok(d)) => {
                let listed =
                    d.ignored.iter().any(|i| i.what.contains(name) || i.path.contains(name));
                if !listed {
                    say(format!("is not listed: {:?}", d.ignored));
                }
            }
            (Status::Equal, Ok(d)) => {
                // Templates contain classes that may be unused.
                let elsewhere = |path: &str| path.contains("default") && !key.contains("default");
                let line = format!("attribute {name}=\"{value}\"");
                let listed =
                    d.ignored.iter().find(|i| i.what.starts_with(&line) && !elsewhere(&i.path));
                if let Some(listed) = listed {
                    say(format!("is listed: {listed}"));
                }
                let same = base.is_ok_and(|base| content(base) == content(d));
                if same && !silent.contains(&place.as_str()) {
                    say("changes nothing".into());
                }
            }
        }
    }
    wrong
}

fn every_attribute(format: Format, templates: &[Template], silent: &[&str]) {
    let table = of(format);
    let (mut wrong, mut tried) = (Vec::new(), 0);
    for (key, row) in &table.rows {
        let equal =
            row.attributes.values().filter(|(s, v)| *s == Status::Equal && v.is_some()).count();
        match templates.iter().find(|(k, _)| k == key) {
            Some((_, template)) => {
                tried += row.attributes.len();
                wrong.extend(attributes(key, row, template, silent));
            }
            // Elements without attributes, and elements that every template contains, do not need
            // their own template.
            None if equal == 0 || ["joint/parent", "joint/child"].contains(&key.as_str()) => {}
            None if key.starts_with("gazebo/") => {}
            None => wrong.push(format!("{key}: no template")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(tried > 40, "{tried}");
}

#[test]
fn every_attribute_of_mjcf_has_its_status() {
    every_attribute(Format::Mjcf, MJCF, SILENT);
}

#[test]
fn every_attribute_of_urdf_has_its_status() {
    every_attribute(Format::Urdf, URDF, URDF_SILENT);
}

/// Tests elements that are ignored or rejected as a whole.
fn whole_elements(format: Format, templates: &[Template], parents: &[(&str, &str)]) {
    let (mut wrong, mut tried) = (Vec::new(), 0);
    for (key, row) in of(format).rows.iter().filter(|(_, r)| r.whole) {
        let Some((parent, name)) = key.split_once('/') else { continue };
        let place = parents.iter().find(|(p, _)| *p == parent).map_or(parent, |(_, k)| *k);
        let Some((_, template)) = templates.iter().find(|(k, _)| *k == place) else {
            wrong.push(format!("{key}: no template of {place}"));
            continue;
        };
        tried += 1;
        let inside = match name {
            "deformable" => "<deformable><flex/></deformable>".to_owned(),
            "extension" => "<extension><plugin/></extension>".to_owned(),
            _ => format!("<{name}/>"),
        };
        let text = with(template, "", &inside);
        match (row.status, read(&text)) {
            (Status::Rejected, Ok(_)) => wrong.push(format!("{key} is accepted: {text}")),
            (Status::Ignored, Err(why)) => wrong.push(format!("{key} is rejected: {why}\n{text}")),
            (Status::Ignored, Ok(d)) => {
                // Either the element itself or the element that contains it is listed.
                let lines = [format!("<{name}>"), format!("<{parent}>")];
                if !d.ignored.iter().any(|i| lines.iter().any(|l| i.what.contains(l.as_str()))) {
                    wrong.push(format!("{key} is not listed: {:?}", d.ignored));
                }
            }
            _ => {}
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(tried > 5, "{tried}");
}

#[test]
fn elements_that_are_not_read_are_listed_or_rejected() {
    let parents = [
        ("mujoco", "mujoco"),
        ("compiler", "mujoco/compiler"),
        ("default", "mujoco/default"),
        ("asset", "mujoco/asset"),
        ("mesh", "asset/mesh"),
        ("material", "asset/material"),
        ("body", "body/body"),
        ("geom", "body/geom"),
        ("tendon", "mujoco/tendon"),
        ("spatial", "tendon/spatial"),
        ("actuator", "mujoco/actuator"),
        ("sensor", "mujoco/sensor"),
        ("equality", "mujoco/equality"),
    ];
    whole_elements(Format::Mjcf, MJCF, &parents);
    let parents = [
        ("robot", "robot"),
        ("link", "robot/link"),
        ("material", "robot/material"),
        ("collision", "link/collision"),
        ("joint", "robot/joint"),
    ];
    whole_elements(Format::Urdf, URDF, &parents);
}

#[test]
fn what_no_specification_has_is_named_with_its_place_and_the_nearest() {
    for (text, path, what) in [
        (
            r#"<mujoco><worldbody><body poss="1 0 0"><joint/><geom size="1"/></body></worldbody></mujoco>"#,
            "body",
            "attribute poss=\"1 0 0\" is not part of the format; did you mean `pos`?",
        ),
        (
            r#"<mujoco><worldbody><body><joint/><geom size="1"/><gem size="1"/></body></worldbody></mujoco>"#,
            "gem",
            "element <gem> is not part of the format; did you mean `geom`?",
        ),
        (
            r#"<robot version="1.1"><link name="a"><inertail/></link></robot>"#,
            "inertail",
            "element <inertail> is not part of the format; did you mean `inertial`?",
        ),
        (
            r#"<sdf version="1.9"><model name="m"><link name="a"><inertial auto_="1"/></link></model></sdf>"#,
            "inertial",
            "attribute auto_=\"1\" is not part of the format; did you mean `auto`?",
        ),
    ] {
        let d = read(text).unwrap_or_else(|e| panic!("{e}"));
        let found =
            d.ignored.iter().any(|i| i.line == 1 && i.path.contains(path) && i.what == what);
        assert!(found, "{what}: {:?}", d.ignored);
    }
    // Names of other programs have a prefix, and are listed without the remark that they are not
    // part of the format.
    let text = r#"<robot version="1.1"><link name="a" drake:x="1"/></robot>"#;
    let d = read(text).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(d.ignored[0].what, "attribute drake:x=\"1\"");
}

/// A file with every supported element and attribute of SDF, except includes, which `cases.rs` tests.
const SDF: &str = r#"<sdf version="1.11"><world name="w">
<frame name="wf" attached_to="m"><pose relative_to="m" degrees="true" rotation_format="euler_rpy">0 0 0 0 0 0</pose></frame>
<joint name="wj" type="fixed"><parent>world</parent><child>m</child></joint>
<model name="m" canonical_link="a" placement_frame="f"><pose relative_to="world" degrees="true" rotation_format="quat_xyzw">0 0 0 0 0 0 1</pose><static>false</static>
<frame name="f" attached_to="a"><pose relative_to="a" degrees="false" rotation_format="euler_rpy">0 0 0 0 0 0</pose></frame>
<link name="a"><gravity>true</gravity><pose relative_to="__model__" degrees="true" rotation_format="euler_rpy">0 0 0 0 0 0</pose>
<inertial><pose degrees="true" rotation_format="euler_rpy">0 0 0 0 0 0</pose><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
<collision name="c"><pose degrees="true" rotation_format="euler_rpy">0 0 0 0 0 0</pose><geometry><box><size>1 1 1</size></box></geometry>
<surface><friction><ode><mu>1</mu><mu2>1</mu2></ode></friction><bounce><restitution_coefficient>0.1</restitution_coefficient></bounce>
<contact><collide_bitmask>1</collide_bitmask><category_bitmask>1</category_bitmask></contact></surface></collision>
<collision name="c2"><geometry><sphere><radius>1</radius></sphere></geometry><surface><friction><bullet><friction>1</friction><friction2>1</friction2></bullet></friction></surface></collision>
<visual name="v"><pose degrees="true" rotation_format="euler_rpy">0 0 0 0 0 0</pose><geometry><cylinder><radius>1</radius><length>1</length></cylinder></geometry><material><diffuse>1 0 0</diffuse></material></visual>
<visual name="v2"><geometry><capsule><radius>1</radius><length>1</length></capsule></geometry><material><ambient>1 0 0</ambient></material></visual>
<visual name="v3"><geometry><ellipsoid><radii>1 1 1</radii></ellipsoid></geometry></visual>
<visual name="v4"><geometry><plane><normal>0 0 1</normal><size>1 1</size></plane></geometry></visual>
<visual name="v5"><geometry><mesh><uri>a.stl</uri><scale>1 1 1</scale></mesh></geometry></visual></link>
<link name="b"><inertial auto="true"><density>5</density></inertial><collision name="c"><density>5</density><geometry><box><size>1 1 1</size></box></geometry></collision></link>
<link name="d"><inertial><mass>1</mass><inertia><ixx>1</ixx></inertia></inertial></link><link name="e"><inertial><mass>1</mass><inertia><ixx>1</ixx></inertia></inertial></link>
<link name="g"><inertial><mass>1</mass><inertia><ixx>1</ixx></inertia></inertial></link>
<joint name="j" type="universal"><parent>a</parent><child>b</child><pose relative_to="b" degrees="true" rotation_format="euler_rpy">0 0 0 0 0 0</pose>
<axis><xyz expressed_in="__model__">1 0 0</xyz><limit><lower>-1</lower><upper>1</upper><effort>1</effort><velocity>1</velocity></limit><dynamics><damping>1</damping><friction>1</friction><spring_stiffness>1</spring_stiffness><spring_reference>1</spring_reference></dynamics>
<use_parent_model_frame>false</use_parent_model_frame><mimic joint="k" axis="axis"><multiplier>1</multiplier><offset>1</offset><reference>1</reference></mimic></axis>
<axis2><xyz expressed_in="__model__">0 1 0</xyz><limit><lower>-1</lower></limit><dynamics><damping>1</damping></dynamics><use_parent_model_frame>false</use_parent_model_frame><mimic joint="k" axis="axis"><multiplier>1</multiplier></mimic></axis2></joint>
<joint name="k" type="screw"><parent>a</parent><child>d</child><axis><xyz>0 0 1</xyz></axis><screw_thread_pitch>1</screw_thread_pitch></joint>
<joint name="l" type="screw"><parent>a</parent><child>e</child><axis><xyz>0 0 1</xyz></axis><thread_pitch>1</thread_pitch></joint>
<joint name="n" type="revolute"><parent>a</parent><child>g</child><axis><xyz>0 0 1</xyz></axis></joint>
<link name="h"><inertial><mass>1</mass><inertia><ixx>1</ixx></inertia></inertial></link>
<joint name="o" type="revolute"><parent>a</parent><child>h</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="p" type="gearbox"><parent>g</parent><child>h</child><gearbox_ratio>2</gearbox_ratio><gearbox_reference_body>a</gearbox_reference_body><axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 0 1</xyz></axis2></joint>
<model name="inner" canonical_link="x" placement_frame="x"><link name="x"><inertial><mass>1</mass><inertia><ixx>1</ixx></inertia></inertial></link></model></model></world></sdf>"#;

/// Collects `parent/element` and `parent/element attribute` of a file.
fn places(e: &crate::xml::Element, parent: &str, out: &mut std::collections::BTreeSet<String>) {
    let key = if parent.is_empty() { e.name.clone() } else { format!("{parent}/{}", e.name) };
    out.extend(e.attributes.iter().map(|a| format!("{key} {}", a.name)));
    out.insert(key);
    e.children.iter().for_each(|c| places(c, &e.name, out));
}

#[test]
fn every_element_of_sdf_has_its_status() {
    let d = read(SDF).unwrap_or_else(|e| panic!("{e}"));
    let unread: Vec<String> = (d.ignored.iter().map(ToString::to_string))
        .filter(|i| i.contains(": element <") || i.contains(": attribute "))
        .collect();
    assert!(unread.is_empty(), "{unread:#?}");
    let mut tried = std::collections::BTreeSet::new();
    places(&crate::xml::parse(SDF, "").unwrap_or_else(|e| panic!("{e}")), "", &mut tried);
    let (mut wrong, mut whole) = (Vec::new(), 0);
    for (key, row) in &of(Format::Sdf).rows {
        let elsewhere =
            key.ends_with("/include") || key.starts_with("include/") || key == "sdf/model";
        if !row.whole && !elsewhere && !tried.contains(key) {
            wrong.push(format!("{key} is not tried"));
        }
        for (name, (status, _)) in row.attributes.iter().filter(|_| !elsewhere) {
            match status {
                Status::Equal if !tried.contains(&format!("{key} {name}")) => {
                    wrong.push(format!("{key} {name} is not tried"))
                }
                _ => {}
            }
        }
        if !row.whole {
            continue;
        }
        // Insert the element into the first element that can contain it.
        let Some((parent, name)) = key.split_once('/').filter(|_| !elsewhere) else { continue };
        let end = format!("</{parent}>");
        let Some((before, after)) = SDF.split_once(&end) else {
            wrong.push(format!("{key}: no {parent}"));
            continue;
        };
        whole += 1;
        let text = format!("{before}<{name}/>{end}{after}");
        match read(&text) {
            Ok(d) => {
                let listed = d
                    .ignored
                    .iter()
                    .any(|i| i.what.contains(&format!("<{name}>")) || i.what.contains(name));
                if !listed {
                    wrong.push(format!("{key} is not listed: {:?}", d.ignored));
                }
            }
            // The element must not cause an error, for example as a second shape or as an unknown
            // shape.
            Err(why) => wrong.push(format!("{key} is rejected: {why}")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(whole > 50 && tried.len() > 100, "{whole} {}", tried.len());
}
