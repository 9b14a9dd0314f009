//! `import: (..)` as written.
use crate::schema::kind::{flag, list_of, text, word};
use crate::schema::record::{Presence, of, record};
use crate::text::value::Text;
use linkwork_formats::{Root, Unphysical};
use linkwork_spatial::{InertiaCheck, Pose};

record! {
    /// An import as written.
    pub(crate) struct ImportForm: "import" {
        /// The file: beside this one, then in the search folders, then embedded.
        file: Text = text().need("write `import: (file: \"robot.urdf\")`"),
        /// What holds bodies that no joint of the file moves.
        root: Root = word(&[
            ("AsWritten", Root::AsWritten),
            ("Fixed", Root::Fixed),
            ("Free", Root::Free),
            ("Planar", Root::Planar),
        ]).or(Root::default()),
        /// Where such bodies hang: `world`, a body, a node or a mount.
        parent: Option<Text> = text().maybe(),
        /// Their pose there.
        at: Pose = of::<Pose>().or(Pose::identity()),
        /// What becomes of moments that no body has: `Warn` reads them with a warning, `Physical` refuses them, `PositiveMoments` accepts
        /// published data with lumped rotors.
        inertia_check: ImportCheck = word(&[
            ("Warn", ImportCheck { inertia: InertiaCheck::Physical, unphysical: Unphysical::Read }),
            ("Physical", ImportCheck { inertia: InertiaCheck::Physical, unphysical: Unphysical::Refused }),
            ("PositiveMoments", ImportCheck { inertia: InertiaCheck::PositiveMoments, unphysical: Unphysical::Refused }),
        ]).or(ImportCheck { inertia: InertiaCheck::Physical, unphysical: Unphysical::Read }),
        /// The keyframe of an MJCF file where the bodies start; default: the reference configuration.
        keyframe: Option<Text> = text().maybe(),
        /// Folders for `package://` and `model://` names.
        packages: Vec<Text> = list_of(text()).or(Vec::new()),
        /// The side-car, when it is not `rover.linkwork.ron` beside `rover.urdf`.
        sidecar: Option<Text> = text().maybe(),
        /// The file's collision shapes collide, and those of the side-car's `contacts`.
        collide: bool = flag().or(false),
        /// What of the file is not wanted.
        leave_out: Vec<Kept> = list_of(word(&[
            ("couplings", Kept::Couplings),
            ("loops", Kept::Loops),
            ("wheels", Kept::Wheels),
            ("actuators", Kept::Actuators),
            ("tendons", Kept::Tendons),
            ("sensors", Kept::Sensors),
        ])).or(Vec::new()),
    }
}

/// What of a file can be left out.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Kept {
    Couplings,
    Loops,
    Wheels,
    Actuators,
    Tendons,
    Sensors,
}

/// What becomes of moments in the file that no body has.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct ImportCheck {
    pub inertia: InertiaCheck,
    pub unphysical: Unphysical,
}
