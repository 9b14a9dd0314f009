//! `import: (..)` as written in a file.
use crate::schema::kind::{flag, list_of, text, word};
use crate::schema::record::{Presence, of, record};
use crate::text::value::Text;
use linkwork_formats::{Root, Unphysical};
use linkwork_spatial::{InertiaCheck, Pose};

record! {
    /// An import as written in a file.
    pub(crate) struct ImportForm: "import" {
        /// The file: relative to this one, then in the search folders, then embedded.
        file: Text = text().need("write `import: (file: \"robot.urdf\")`"),
        /// Hinge of the bodies that no joint of the file moves.
        root: Root = word(&[
            ("AsWritten", Root::AsWritten),
            ("Fixed", Root::Fixed),
            ("Free", Root::Free),
            ("Planar", Root::Planar),
        ]).or(Root::default()),
        /// Parent of such bodies: `world`, a body, a node or a mount.
        parent: Option<Text> = text().maybe(),
        /// Their pose there.
        at: Pose = of::<Pose>().or(Pose::identity()),
        /// Handling of inertias that no rigid body can have: `Warn` reads them with a warning, `Physical` rejects them, `PositiveMoments` accepts
        /// published data with lumped rotors.
        inertia_check: ImportCheck = word(&[
            ("Warn", ImportCheck { inertia: InertiaCheck::Physical, unphysical: Unphysical::Read }),
            ("Physical", ImportCheck { inertia: InertiaCheck::Physical, unphysical: Unphysical::Refused }),
            ("PositiveMoments", ImportCheck { inertia: InertiaCheck::PositiveMoments, unphysical: Unphysical::Refused }),
        ]).or(ImportCheck { inertia: InertiaCheck::Physical, unphysical: Unphysical::Read }),
        /// Keyframe of an MJCF file that defines the start (default: the reference configuration).
        keyframe: Option<Text> = text().maybe(),
        /// Folders for `package://` and `model://` names.
        packages: Vec<Text> = list_of(text()).or(Vec::new()),
        /// The companion file (default: `rover.linkwork.ron` for `rover.urdf`).
        companion: Option<Text> = text().maybe(),
        /// Whether the collision shapes of the file, and those in `contacts` of the companion file, collide.
        collide: bool = flag().or(false),
        /// Parts of the file that are omitted.
        leave_out: Vec<Optional> = list_of(word(&[
            ("couplings", Optional::Couplings),
            ("loops", Optional::Loops),
            ("wheels", Optional::Wheels),
            ("actuators", Optional::Actuators),
            ("tendons", Optional::Tendons),
            ("sensors", Optional::Sensors),
        ])).or(Vec::new()),
    }
}

/// Parts of a file that can be omitted.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Optional {
    Couplings,
    Loops,
    Wheels,
    Actuators,
    Tendons,
    Sensors,
}

/// Handling of inertias in the file that no rigid body can have.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct ImportCheck {
    pub inertia: InertiaCheck,
    pub unphysical: Unphysical,
}
