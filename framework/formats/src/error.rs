//! What can be wrong with a file: place, fact, remedy, all mistakes at once.

use linkwork_multibody::MechanismFault;
use linkwork_spatial::InertiaError;
use thiserror::Error;

/// A place in a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct FilePlace {
    /// The file as it was named; `<text>` when the text came without one.
    pub file: String,
    /// Line, from 1; 0 when the whole file is meant.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
}

impl std::fmt::Display for FilePlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            0 => write!(f, "{}", self.file),
            _ => write!(f, "{}:{}:{}", self.file, self.line, self.column),
        }
    }
}

/// What is wrong, without the place.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FaultKind {
    /// The file cannot be read.
    #[error("cannot be read: {reason}\n  help: give the path of a URDF, MJCF or SDF file")]
    Unreadable {
        /// The system's words.
        reason: String,
    },
    /// The text is not XML.
    #[error("this is not well-formed XML: {reason}\n  help: mend the file at this place")]
    Xml {
        /// The parser's words.
        reason: String,
    },
    /// Elements are nested too deeply.
    #[error("elements are nested more than {limit} deep\n  help: flatten the file")]
    TooDeep {
        /// The limit.
        limit: usize,
    },
    /// An element has too many attributes.
    #[error(
        "an element has more than {limit} attributes\n  help: no robot file has as many: take another copy of the file"
    )]
    TooCrowded {
        /// The limit.
        limit: usize,
    },
    /// The file must go through xacro first.
    #[error(
        "`{text}` belongs to xacro, which is not run here\n  help: write the expanded file with \
         `xacro robot.urdf.xacro > robot.urdf` and read that"
    )]
    Xacro {
        /// The element or value.
        text: String,
    },
    /// The outermost element belongs to another format, or to none.
    #[error("the outermost element is <{found}>, not {expected}\n  help: {help}")]
    WrongRoot {
        /// What is there.
        found: String,
        /// What should be.
        expected: &'static str,
        /// What to do.
        help: String,
    },
    /// Something required is not there.
    #[error("{what} has no {missing}\n  help: {help}")]
    Missing {
        /// Where it is missing.
        what: String,
        /// What is missing.
        missing: String,
        /// What to write.
        help: String,
    },
    /// A text that should be numbers.
    #[error("{what} is `{text}`, not {expected}\n  help: {help}")]
    BadValue {
        /// What it is the value of.
        what: String,
        /// What is written.
        text: String,
        /// What it should be.
        expected: String,
        /// What to write.
        help: String,
    },
    /// A joint of a type that does not exist here.
    #[error("joint `{joint}` is of the unknown type `{kind}`\n  help: {help}")]
    UnknownJointType {
        /// The joint.
        joint: String,
        /// What is written.
        kind: String,
        /// The nearest type, or all.
        help: String,
    },
    /// A name that leads nowhere.
    #[error("{what} names the {kind} `{name}`, which is not there\n  help: {help}")]
    UnknownName {
        /// Who names it.
        what: String,
        /// What kind of thing.
        kind: &'static str,
        /// The name.
        name: String,
        /// The nearest name, or what to do.
        help: String,
    },
    /// One name for two things.
    #[error("{kind} `{name}` is defined again; first at {first}\n  help: give each its own name")]
    Duplicate {
        /// What kind of thing.
        kind: &'static str,
        /// The name.
        name: String,
        /// Where it is defined first.
        first: FilePlace,
    },
    /// A name that cannot be used.
    #[error("{kind} name `{name}` is not usable\n  help: {help}")]
    BadName {
        /// What kind of thing.
        kind: &'static str,
        /// The name.
        name: String,
        /// What to do.
        help: String,
    },
    /// A link that two joints move.
    #[error(
        "link `{link}` is the child of `{joint}` and of `{first}`\n  help: keep one of them; what \
         closes a loop is a constraint, which a tree of joints cannot say"
    )]
    TwoParents {
        /// The link.
        link: String,
        /// The second joint.
        joint: String,
        /// The first joint.
        first: String,
    },
    /// Links that hang on each other in a ring.
    #[error(
        "links form a ring: {}\n  help: remove one joint of the ring; what closes a loop is a \
         constraint",
        path.join(" -> ")
    )]
    Cycle {
        /// Link, its parent, … and the first again.
        path: Vec<String>,
    },
    /// More than one link without a parent.
    #[error(
        "{} links are not the child of any joint: {}\n  help: a file has one root; connect the \
         others with joints, or remove them",
        roots.len(), roots.join(", ")
    )]
    SeveralRoots {
        /// Their names.
        roots: Vec<String>,
    },
    /// Mass properties that no body has.
    #[error("{what}: {error}\n  help: {help}")]
    Inertia {
        /// The link.
        what: String,
        /// The reasons.
        error: InertiaError,
        /// What to do.
        help: String,
    },
    /// An include that includes itself.
    #[error("files include each other in a ring: {}\n  help: remove one include", path.join(" -> "))]
    IncludeCycle {
        /// The files.
        path: Vec<String>,
    },
    /// A file that is named and not there.
    #[error("{what} names the file `{name}`, which cannot be read: {reason}\n  help: {help}")]
    NoFile {
        /// Who names it.
        what: String,
        /// The name.
        name: String,
        /// Why.
        reason: String,
        /// What to do.
        help: String,
    },
    /// Something that the format has and this reader cannot turn into a mechanism.
    #[error("{what}\n  help: {help}")]
    Unsupported {
        /// The fact.
        what: String,
        /// What to do.
        help: String,
    },
    /// The mechanism that came of it is not sound.
    #[error("{0}")]
    Build(MechanismFault),
}

/// One mistake, with its place.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{place}: {kind}")]
pub struct FileFault {
    /// Where.
    pub place: FilePlace,
    /// What.
    pub kind: FaultKind,
}

/// Why a file is refused: all its mistakes in the order of the file.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{}", lines(faults))]
pub struct FormatError {
    /// The mistakes, at least one.
    pub faults: Vec<FileFault>,
}

fn lines(faults: &[FileFault]) -> String {
    faults.iter().map(FileFault::to_string).collect::<Vec<_>>().join("\n")
}
