//! Files for each element of MJCF, to test the attributes of its line in the table.

/// A file with an element: `@` is replaced by its attributes, before the required ones; `#` by an element inside.
pub(super) type Template = (&'static str, &'static str);

macro_rules! LOOP {
    ($kind:literal) => {
        concat!(
            r#"<mujoco><default><default class="c"><equality active="false"/></default></default><worldbody><site name="r" pos="2 0 0"/><body name="k" pos="3 0 0"><joint/><geom size="1"/></body><body name="a" pos="1 0 0"><joint/><geom size="1"/><site name="s" pos="0 1 0"/></body><body name="b"><joint/><geom size="1"/></body></worldbody><equality><"#,
            $kind, r#" @ body1="k" anchor="0 0 0"/></equality></mujoco>"#
        )
    };
}
macro_rules! DEVICES {
    ($default:expr, $inside:expr) => {
        concat!(
            "<mujoco><default>", $default, r#"<default class="c"><motor gear="7"/><position gear="7"/><tendon damping="9"/></default></default><worldbody><body name="a"><joint name="p" range="-50 50"/><joint name="q" axis="1 0 0" range="-60 80"/><geom size="1"/><site name="s"/><site name="r" pos="1 0 0"/></body></worldbody><tendon><fixed name="u"><joint joint="p" coef="3"/></fixed><fixed name="k"><joint joint="p" coef="2"/></fixed></tendon>"#, $inside, "</mujoco>"
        )
    };
}
macro_rules! ACTUATOR {
    ($kind:literal) => {
        DEVICES!("", concat!("<actuator><", $kind, r#" @ joint="p"/></actuator>"#))
    };
}
macro_rules! ACTUATOR_CLASS {
    ($kind:literal) => {
        DEVICES!(
            concat!("<", $kind, " @/>"),
            concat!("<actuator><", $kind, r#" joint="p"/></actuator>"#)
        )
    };
}
macro_rules! SENSOR {
    ($kind:literal, $of:literal) => {
        DEVICES!("", concat!(r#"<actuator><motor name="w" joint="p"/><motor name="z" joint="p"/></actuator><sensor><"#, $kind, " @ ", $of, "/></sensor>"))
    };
}
macro_rules! SUBTREE {
    ($kind:literal) => {
        concat!(
            r#"<mujoco><worldbody><body name="a"><joint/><geom size="1"/><body name="b"><joint axis="1 0 0"/><geom size="1"/></body></body></worldbody><sensor><"#,
            $kind,
            r#" @ body="a"/></sensor></mujoco>"#
        )
    };
}
macro_rules! BALL {
    ($kind:literal) => {
        concat!(
            r#"<mujoco><worldbody><body><joint name="u" type="ball"/><geom size="1"/><body><joint name="q" type="ball"/><geom size="1"/></body></body></worldbody><sensor><"#,
            $kind,
            r#" @ joint="u"/></sensor></mujoco>"#
        )
    };
}

pub(super) const MJCF: &[Template] = &[
    (
        "mujoco",
        r#"<mujoco @><worldbody><body><joint/><geom size="1"/></body></worldbody>#</mujoco>"#,
    ),
    (
        "mujoco/compiler",
        r#"<mujoco><compiler @>#</compiler><worldbody><body euler="1 2 3"><joint range="1 2" pos="1 0 0"/><inertial mass="1" pos="0 0 0" diaginertia="0.01 0.02 0.05"/><geom size="1" group="3"/><geom type="box" size="1 1 1"/></body></worldbody></mujoco>"#,
    ),
    (
        "mujoco/default",
        r#"<mujoco><default @>#</default><worldbody><body><joint/><geom size="1"/></body></worldbody></mujoco>"#,
    ),
    (
        "default/default",
        r#"<mujoco><default><default @><geom density="5"/></default></default><worldbody><body childclass="x"><joint/><geom size="1"/></body></worldbody></mujoco>"#,
    ),
    (
        "default/mesh",
        r#"<mujoco><default><mesh @/></default><asset><mesh name="m" face="0 2 1 0 1 3 0 3 2 1 2 3 0 1 4" vertex="0 0 0 1 0 0 0 1 0 0 0 1 0 -1 -1"/></asset><worldbody><body><joint/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>"#,
    ),
    (
        "default/joint",
        r#"<mujoco><default><joint @/></default><worldbody><body><joint/><geom size="1"/></body></worldbody></mujoco>"#,
    ),
    (
        "default/geom",
        r#"<mujoco><default><geom @ type="capsule" size="0.1 0.2"/></default><asset><material name="a" rgba="1 0 0 1"/><mesh name="b" face="0 2 1 0 1 3 0 3 2 1 2 3" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/><hfield name="k" nrow="2" ncol="2" size="1 1 1 1"/></asset><worldbody><body><joint/><geom/></body></worldbody></mujoco>"#,
    ),
    (
        "default/site",
        r#"<mujoco><default><site @/></default><worldbody><body><joint/><geom size="1"/><site name="s"/></body></worldbody></mujoco>"#,
    ),
    (
        "default/equality",
        r#"<mujoco><default><equality @/></default><worldbody><body><joint name="p"/><geom size="1"/></body></worldbody><equality><joint joint1="p"/></equality></mujoco>"#,
    ),
    (
        "asset/mesh",
        r#"<mujoco><default><default class="c"/></default><asset><mesh @ name="b" face="0 2 1 0 1 3 0 3 2 1 2 3" vertex="0 0 0 1 0 0 0 1 0 0 0 1">#</mesh></asset><worldbody><body><joint/><geom type="mesh" mesh="b"/></body></worldbody></mujoco>"#,
    ),
    (
        "asset/hfield",
        r#"<mujoco><asset><hfield @ name="k" nrow="3" ncol="4" size="1 1 1 1" elevation="0 1 2 3 4 5 6 7 8 9 10 11"/></asset><worldbody><geom type="hfield" hfield="k"/><body><joint/><geom size="1"/></body></worldbody></mujoco>"#,
    ),
    (
        "asset/material",
        r#"<mujoco><asset><material @ name="a">#</material></asset><worldbody><body><joint/><geom size="1" material="a"/></body></worldbody></mujoco>"#,
    ),
    (
        "mujoco/asset",
        r#"<mujoco><asset @>#</asset><worldbody><body><joint/><geom size="1"/></body></worldbody></mujoco>"#,
    ),
    (
        "mujoco/worldbody",
        r#"<mujoco><default><default class="c"><geom density="3"/></default></default><worldbody @><body><joint/><geom size="1"/></body>#</worldbody></mujoco>"#,
    ),
    (
        "body/frame",
        r#"<mujoco><default><default class="c"><geom density="3"/></default></default><worldbody><frame @><body pos="0 0 1"><joint axis="1 2 3"/><geom size="1"/></body></frame></worldbody></mujoco>"#,
    ),
    (
        "body/replicate",
        r#"<mujoco><default><default class="c"><geom density="3"/></default></default><worldbody><replicate @ count="2"><body name="b" pos="0 1 0"><joint axis="1 2 3"/><geom size="1"/></body></replicate></worldbody></mujoco>"#,
    ),
    (
        "body/body",
        r#"<mujoco><default><default class="c"><geom density="3"/></default></default><worldbody><body @><joint axis="1 2 3"/><geom size="1"/>#</body></worldbody></mujoco>"#,
    ),
    (
        "body/inertial",
        r#"<mujoco><worldbody><body><joint/><inertial @ mass="1" pos="0 0 0" diaginertia="1 1.2 1.3"/></body></worldbody></mujoco>"#,
    ),
    (
        "body/joint",
        r#"<mujoco><default><default class="c"><joint damping="3"/></default></default><worldbody><body><joint @/><geom size="1"/></body></worldbody></mujoco>"#,
    ),
    (
        "body/freejoint",
        r#"<mujoco><worldbody><body><freejoint @/><geom size="1"/></body></worldbody></mujoco>"#,
    ),
    (
        "body/geom",
        r#"<mujoco><default><default class="c"><geom density="3"/></default></default><asset><material name="a" rgba="1 0 0 1"/><mesh name="b" face="0 2 1 0 1 3 0 3 2 1 2 3" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/><hfield name="k" nrow="2" ncol="2" size="1 1 1 1"/></asset><worldbody><body><joint/><geom size="1"/><geom @ type="box" size="0.1 0.2 0.3">#</geom></body></worldbody></mujoco>"#,
    ),
    (
        "body/site",
        r#"<mujoco><default><default class="c"><site pos="0 0 9"/></default></default><worldbody><body><joint/><geom size="1"/><site @ name="s"/></body></worldbody></mujoco>"#,
    ),
    (
        "mujoco/contact",
        r#"<mujoco><worldbody><body><joint/><geom size="1"/></body></worldbody><contact @>#</contact></mujoco>"#,
    ),
    (
        "contact/pair",
        r#"<mujoco><default><default class="c"/></default><worldbody><body><joint/><geom name="g" size="1"/><geom name="e" size="1"/></body><body><joint/><geom name="h" size="1"/></body></worldbody><contact><pair @ geom1="e" geom2="e"/></contact></mujoco>"#,
    ),
    (
        "contact/exclude",
        r#"<mujoco><worldbody><body name="a"><joint/><geom size="1"/></body><body name="b"><joint/><geom size="1"/></body></worldbody><contact><exclude @ body1="world" body2="world"/></contact></mujoco>"#,
    ),
    (
        "mujoco/tendon",
        r#"<mujoco><worldbody><body><joint/><geom size="1"/></body></worldbody><tendon @>#</tendon></mujoco>"#,
    ),
    (
        "tendon/spatial",
        DEVICES!(
            "",
            r#"<tendon><spatial @ name="t"><site site="s"/><site site="r"/>#</spatial></tendon>"#
        ),
    ),
    (
        "spatial/site",
        DEVICES!(
            "",
            r#"<tendon><spatial name="t"><site site="r"/><site @ site="s"/></spatial></tendon>"#
        ),
    ),
    (
        "tendon/fixed",
        DEVICES!("", r#"<tendon><fixed @ name="t"><joint joint="p" coef="1"/></fixed></tendon>"#),
    ),
    (
        "fixed/joint",
        r#"<mujoco><worldbody><body><joint name="p"/><joint name="r" axis="1 0 0"/><geom size="1"/></body></worldbody><tendon><fixed name="t"><joint @ joint="r" coef="1"/></fixed></tendon><equality><tendon tendon1="t"/></equality></mujoco>"#,
    ),
    ("mujoco/actuator", DEVICES!("", "<actuator @>#</actuator>")),
    ("mujoco/sensor", DEVICES!("", "<sensor @>#</sensor>")),
    ("actuator/general", ACTUATOR!("general")),
    ("default/general", ACTUATOR_CLASS!("general")),
    ("actuator/motor", ACTUATOR!("motor")),
    ("default/motor", ACTUATOR_CLASS!("motor")),
    ("actuator/position", ACTUATOR!("position")),
    ("default/position", ACTUATOR_CLASS!("position")),
    ("actuator/velocity", ACTUATOR!("velocity")),
    ("default/velocity", ACTUATOR_CLASS!("velocity")),
    ("actuator/damper", ACTUATOR!("damper")),
    ("default/damper", ACTUATOR_CLASS!("damper")),
    (
        "actuator/intvelocity",
        DEVICES!("", r#"<actuator><intvelocity @ joint="p" actrange="-1 1"/></actuator>"#),
    ),
    (
        "default/intvelocity",
        DEVICES!(
            r#"<intvelocity @ actrange="-1 1"/>"#,
            r#"<actuator><intvelocity joint="p"/></actuator>"#
        ),
    ),
    ("actuator/cylinder", ACTUATOR!("cylinder")),
    ("default/cylinder", ACTUATOR_CLASS!("cylinder")),
    ("sensor/force", SENSOR!("force", "site=\"s\"")),
    ("sensor/torque", SENSOR!("torque", "site=\"s\"")),
    ("sensor/gyro", SENSOR!("gyro", "site=\"s\"")),
    ("sensor/touch", SENSOR!("touch", "site=\"s\"")),
    ("sensor/rangefinder", SENSOR!("rangefinder", "site=\"s\"")),
    ("sensor/velocimeter", SENSOR!("velocimeter", "site=\"s\"")),
    ("sensor/accelerometer", SENSOR!("accelerometer", "site=\"s\"")),
    ("sensor/jointpos", SENSOR!("jointpos", "joint=\"p\"")),
    ("sensor/jointvel", SENSOR!("jointvel", "joint=\"p\"")),
    ("sensor/tendonpos", SENSOR!("tendonpos", "tendon=\"k\"")),
    ("sensor/tendonvel", SENSOR!("tendonvel", "tendon=\"k\"")),
    ("sensor/actuatorpos", SENSOR!("actuatorpos", "actuator=\"z\"")),
    ("sensor/actuatorvel", SENSOR!("actuatorvel", "actuator=\"z\"")),
    ("sensor/actuatorfrc", SENSOR!("actuatorfrc", "actuator=\"z\"")),
    ("sensor/framepos", SENSOR!("framepos", "objtype=\"xbody\" objname=\"a\"")),
    ("sensor/framequat", SENSOR!("framequat", "objtype=\"xbody\" objname=\"a\"")),
    ("sensor/framelinvel", SENSOR!("framelinvel", "objtype=\"xbody\" objname=\"a\"")),
    ("sensor/framexaxis", SENSOR!("framexaxis", "objtype=\"xbody\" objname=\"a\"")),
    ("sensor/frameyaxis", SENSOR!("frameyaxis", "objtype=\"xbody\" objname=\"a\"")),
    ("sensor/framezaxis", SENSOR!("framezaxis", "objtype=\"xbody\" objname=\"a\"")),
    ("sensor/frameangvel", SENSOR!("frameangvel", "objtype=\"xbody\" objname=\"a\"")),
    ("sensor/framelinacc", SENSOR!("framelinacc", "objtype=\"xbody\" objname=\"a\"")),
    ("sensor/frameangacc", SENSOR!("frameangacc", "objtype=\"xbody\" objname=\"a\"")),
    ("sensor/subtreecom", SUBTREE!("subtreecom")),
    ("sensor/subtreelinvel", SUBTREE!("subtreelinvel")),
    ("sensor/subtreeangmom", SUBTREE!("subtreeangmom")),
    ("sensor/ballquat", BALL!("ballquat")),
    ("sensor/ballangvel", BALL!("ballangvel")),
    (
        "default/tendon",
        DEVICES!(
            "<tendon @/>",
            r#"<tendon><fixed name="t"><joint joint="p" coef="1"/></fixed></tendon>"#
        ),
    ),
    (
        "mujoco/equality",
        r#"<mujoco><worldbody><body><joint/><geom size="1"/></body></worldbody><equality @>#</equality></mujoco>"#,
    ),
    ("equality/connect", LOOP!("connect")),
    ("equality/weld", LOOP!("weld")),
    (
        "equality/joint",
        r#"<mujoco><default><default class="c"><equality active="false"/></default></default><worldbody><body><joint name="p"/><joint name="q" axis="1 0 0"/><joint name="k" axis="0 1 0"/><geom size="1"/></body></worldbody><equality><joint @ joint1="k"/></equality></mujoco>"#,
    ),
    (
        "equality/tendon",
        r#"<mujoco><default><default class="c"><equality active="false"/></default></default><worldbody><body><joint name="p"/><joint name="q" axis="1 0 0"/><geom size="1"/></body></worldbody><tendon><fixed name="t"><joint joint="p" coef="1"/></fixed><fixed name="u"><joint joint="q" coef="1"/></fixed><fixed name="k"><joint joint="q" coef="3"/></fixed></tendon><equality><tendon @ tendon1="k"/></equality></mujoco>"#,
    ),
    (
        "keyframe/key",
        r#"<mujoco><worldbody><body><joint/><geom size="1"/></body></worldbody><keyframe><key @/></keyframe></mujoco>"#,
    ),
];

/// Attributes that are read but do not change these files.
pub(super) const SILENT: &[&str] = &[
    "mujoco/compiler coordinate",
    "mujoco/compiler autolimits",
    "mujoco/compiler meshdir",
    "mujoco/compiler assetdir",
    "mujoco/compiler strippath",
    "mujoco/compiler inertiagrouprange",
    "mujoco/default class",
    "default/default class",
    "default/joint limited",
    "default/joint actuatorfrclimited",
    "default/geom surfacevel",
    "asset/mesh class",
    "asset/mesh name",
    "asset/mesh vertex",
    "asset/mesh face",
    "asset/hfield name",
    "asset/material name",
    "body/frame name",
    "body/joint limited",
    "body/joint actuatorfrclimited",
    "body/geom surfacevel",
    "contact/pair class",
    "contact/pair name",
    "contact/exclude name",
    "actuator/intvelocity ctrllimited",
    "actuator/intvelocity forcelimited",
    "actuator/cylinder ctrllimited",
    "actuator/cylinder forcelimited",
    "actuator/general actlimited",
    "default/intvelocity ctrllimited",
    "default/intvelocity forcelimited",
    "default/cylinder ctrllimited",
    "default/cylinder forcelimited",
    "default/general actlimited",
    "actuator/general ctrllimited",
    "actuator/general forcelimited",
    "actuator/motor ctrllimited",
    "actuator/motor forcelimited",
    "actuator/position ctrllimited",
    "actuator/position forcelimited",
    "actuator/velocity ctrllimited",
    "actuator/velocity forcelimited",
    "actuator/damper ctrllimited",
    "actuator/damper forcelimited",
    "default/general ctrllimited",
    "default/general forcelimited",
    "default/motor ctrllimited",
    "default/motor forcelimited",
    "default/position ctrllimited",
    "default/position forcelimited",
    "default/velocity ctrllimited",
    "default/velocity forcelimited",
    "default/damper ctrllimited",
    "default/damper forcelimited",
    "default/tendon limited",
    "tendon/fixed limited",
    "tendon/fixed name",
    "tendon/spatial name",
    "tendon/spatial limited",
    "keyframe/key name",
];

/// Attributes that require others, which are added.
pub(super) const WITH: &[(&str, &str)] = &[
    ("default/joint limited", r#"range="0 30""#),
    ("body/joint limited", r#"range="0 30""#),
    ("default/joint actuatorfrclimited", r#"actuatorfrcrange="-1 1""#),
    ("body/joint actuatorfrclimited", r#"actuatorfrcrange="-1 1""#),
    ("equality/connect site1", r#"site2="r""#),
    ("equality/connect site2", r#"site1="s""#),
    ("equality/weld site1", r#"site2="r""#),
    ("equality/weld site2", r#"site1="s""#),
    ("body/geom mesh", r#"type="mesh""#),
    ("default/geom mesh", r#"type="mesh""#),
    ("body/geom hfield", r#"type="hfield""#),
    ("default/geom hfield", r#"type="hfield""#),
    ("asset/hfield elevation", r#"nrow="2" ncol="2""#),
    ("asset/hfield nrow", r#"ncol="2" elevation="0 1 2 5""#),
    ("asset/hfield ncol", r#"nrow="2" elevation="0 1 2 5""#),
    ("contact/pair geom2", r#"geom1="g""#),
    ("contact/exclude body2", r#"body1="a""#),
    ("equality/joint polycoef", r#"joint2="q""#),
    ("equality/tendon polycoef", r#"tendon2="u""#),
    ("default/joint springref", r#"stiffness="1""#),
    ("body/joint springref", r#"stiffness="1""#),
    ("actuator/intvelocity ctrllimited", r#"ctrlrange="-1 1""#),
    ("actuator/intvelocity forcelimited", r#"forcerange="-1 1""#),
    ("actuator/cylinder ctrllimited", r#"ctrlrange="-1 1""#),
    ("actuator/cylinder forcelimited", r#"forcerange="-1 1""#),
    ("actuator/general actlimited", r#"actrange="-1 1" dyntype="integrator""#),
    ("actuator/general actrange", r#"dyntype="integrator""#),
    ("actuator/general dynprm", r#"dyntype="filter""#),
    ("default/intvelocity ctrllimited", r#"ctrlrange="-1 1""#),
    ("default/intvelocity forcelimited", r#"forcerange="-1 1""#),
    ("default/cylinder ctrllimited", r#"ctrlrange="-1 1""#),
    ("default/cylinder forcelimited", r#"forcerange="-1 1""#),
    ("default/general actlimited", r#"actrange="-1 1" dyntype="integrator""#),
    ("default/general actrange", r#"dyntype="integrator""#),
    ("default/general dynprm", r#"dyntype="filter""#),
    ("actuator/general refsite", r#"site="s""#),
    ("actuator/motor refsite", r#"site="s""#),
    ("actuator/position refsite", r#"site="s""#),
    ("actuator/velocity refsite", r#"site="s""#),
    ("actuator/damper refsite", r#"site="s""#),
    ("actuator/intvelocity refsite", r#"site="s""#),
    ("actuator/cylinder refsite", r#"site="s""#),
    ("actuator/general ctrllimited", r#"ctrlrange="-1 1""#),
    ("actuator/general forcelimited", r#"forcerange="-1 1""#),
    ("actuator/motor ctrllimited", r#"ctrlrange="-1 1""#),
    ("actuator/motor forcelimited", r#"forcerange="-1 1""#),
    ("actuator/position ctrllimited", r#"ctrlrange="-1 1""#),
    ("actuator/position forcelimited", r#"forcerange="-1 1""#),
    ("actuator/velocity ctrllimited", r#"ctrlrange="-1 1""#),
    ("actuator/velocity forcelimited", r#"forcerange="-1 1""#),
    ("actuator/damper ctrllimited", r#"ctrlrange="-1 1""#),
    ("actuator/damper forcelimited", r#"forcerange="-1 1""#),
    ("actuator/general gaintype", r#"gainprm="1 2 3""#),
    ("actuator/general inheritrange", r#"biastype="affine" biasprm="0 -1""#),
    ("actuator/general biastype", r#"biasprm="1 2 3""#),
    ("actuator/general biasprm", r#"biastype="affine""#),
    ("default/general ctrllimited", r#"ctrlrange="-1 1""#),
    ("default/general forcelimited", r#"forcerange="-1 1""#),
    ("default/motor ctrllimited", r#"ctrlrange="-1 1""#),
    ("default/motor forcelimited", r#"forcerange="-1 1""#),
    ("default/position ctrllimited", r#"ctrlrange="-1 1""#),
    ("default/position forcelimited", r#"forcerange="-1 1""#),
    ("default/velocity ctrllimited", r#"ctrlrange="-1 1""#),
    ("default/velocity forcelimited", r#"forcerange="-1 1""#),
    ("default/damper ctrllimited", r#"ctrlrange="-1 1""#),
    ("default/damper forcelimited", r#"forcerange="-1 1""#),
    ("default/general gaintype", r#"gainprm="1 2 3""#),
    ("default/general inheritrange", r#"biastype="affine" biasprm="0 -1""#),
    ("default/general biastype", r#"biasprm="1 2 3""#),
    ("default/general biasprm", r#"biastype="affine""#),
    ("default/tendon limited", r#"range="-1 1""#),
    ("tendon/fixed limited", r#"range="-1 1""#),
    ("tendon/spatial limited", r#"range="0 1""#),
    ("sensor/framepos objtype", r#"objname="s""#),
    ("sensor/framepos objname", r#"objtype="site""#),
    ("sensor/framepos reftype", r#"refname="s""#),
    ("sensor/framepos refname", r#"reftype="site""#),
    ("sensor/framequat objtype", r#"objname="s""#),
    ("sensor/framequat objname", r#"objtype="site""#),
    ("sensor/framequat reftype", r#"refname="s""#),
    ("sensor/framequat refname", r#"reftype="site""#),
    ("sensor/framelinvel objtype", r#"objname="s""#),
    ("sensor/framelinvel objname", r#"objtype="site""#),
    ("sensor/framelinvel reftype", r#"refname="s""#),
    ("sensor/framelinvel refname", r#"reftype="site""#),
    ("sensor/framexaxis objtype", r#"objname="s""#),
    ("sensor/framexaxis objname", r#"objtype="site""#),
    ("sensor/framexaxis reftype", r#"refname="s""#),
    ("sensor/framexaxis refname", r#"reftype="site""#),
    ("sensor/frameyaxis objtype", r#"objname="s""#),
    ("sensor/frameyaxis objname", r#"objtype="site""#),
    ("sensor/frameyaxis reftype", r#"refname="s""#),
    ("sensor/frameyaxis refname", r#"reftype="site""#),
    ("sensor/framezaxis objtype", r#"objname="s""#),
    ("sensor/framezaxis objname", r#"objtype="site""#),
    ("sensor/framezaxis reftype", r#"refname="s""#),
    ("sensor/framezaxis refname", r#"reftype="site""#),
    ("sensor/frameangvel objtype", r#"objname="s""#),
    ("sensor/frameangvel objname", r#"objtype="site""#),
    ("sensor/frameangvel reftype", r#"refname="s""#),
    ("sensor/frameangvel refname", r#"reftype="site""#),
    ("sensor/framelinacc objtype", r#"objname="s""#),
    ("sensor/framelinacc objname", r#"objtype="site""#),
    ("sensor/frameangacc objtype", r#"objname="s""#),
    ("sensor/frameangacc objname", r#"objtype="site""#),
    ("body/inertial fullinertia", r#"pos="0.1 0 0""#),
];
