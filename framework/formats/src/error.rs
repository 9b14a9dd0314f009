//! Faults of a file: position, fact and remedy, all at once.

use linkwork_multibody::MechanismFault;
use linkwork_spatial::InertiaError;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A position in a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct FilePlace {
    /// Name of the file; `<text>` for a text without a file.
    pub file: String,
    /// Line, from 1; 0 for the whole file.
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

/// A fault without its position.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FaultKind {
    /// The file cannot be read.
    #[error("cannot be read: {reason}\n  help: give the path of a URDF, MJCF or SDF file")]
    Unreadable {
        /// The system's words.
        reason: String,
    },
    /// The text is not XML.
    #[error("this is not well-formed XML: {reason}\n  help: correct the file at this position")]
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
        "an element has more than {limit} attributes\n  help: this is not plausible for a robot file: check the file"
    )]
    TooCrowded {
        /// The limit.
        limit: usize,
    },
    /// A file with unexpanded xacro.
    #[error(
        "`{text}` requires xacro, which is not supported\n  help: write the expanded file with \
         `xacro robot.urdf.xacro > robot.urdf` and read the result"
    )]
    Xacro {
        /// The element or value.
        text: String,
    },
    /// The outermost element is not that of the format.
    #[error("the outermost element is <{found}>, not {expected}\n  help: {help}")]
    WrongRoot {
        /// The element found.
        found: String,
        /// The expected element.
        expected: &'static str,
        /// The remedy.
        help: String,
    },
    /// Required content is missing.
    #[error("{what} lacks {missing}\n  help: {help}")]
    Missing {
        /// The place at which it is missing.
        what: String,
        /// The missing content.
        missing: String,
        /// The remedy.
        help: String,
    },
    /// A text with an invalid value.
    #[error("{what} is `{text}`, not {expected}\n  help: {help}")]
    BadValue {
        /// Name of the value.
        what: String,
        /// The text found.
        text: String,
        /// The expected value.
        expected: String,
        /// The remedy.
        help: String,
    },
    /// An unknown joint type.
    #[error("joint `{joint}` has the unknown type `{kind}`\n  help: {help}")]
    UnknownJointType {
        /// The joint.
        joint: String,
        /// The type found.
        kind: String,
        /// The nearest type, or all.
        help: String,
    },
    /// An unknown name.
    #[error("{what} refers to the {kind} `{name}`, which does not exist\n  help: {help}")]
    UnknownName {
        /// The element with this reference.
        what: String,
        /// Kind of item.
        kind: &'static str,
        /// The name.
        name: String,
        /// The nearest name, or another remedy.
        help: String,
    },
    /// Two items with the same name.
    #[error(
        "{kind} `{name}` is defined again; the first definition is at {first}\n  help: use different names"
    )]
    Duplicate {
        /// Kind of item.
        kind: &'static str,
        /// The name.
        name: String,
        /// Position of the first definition.
        first: FilePlace,
    },
    /// An invalid name.
    #[error("{kind} name `{name}` is not allowed\n  help: {help}")]
    BadName {
        /// Kind of item.
        kind: &'static str,
        /// The name.
        name: String,
        /// The remedy.
        help: String,
    },
    /// A link that is the child of two joints.
    #[error(
        "link `{link}` is the child of `{joint}` and of `{first}`\n  help: keep one of them; a \
         closed loop requires a constraint, which a tree of joints cannot contain"
    )]
    TwoParents {
        /// The link.
        link: String,
        /// The second joint.
        joint: String,
        /// The first joint.
        first: String,
    },
    /// Links that are circular parents of each other.
    #[error(
        "links form a circle: {}\n  help: remove one joint of the circle; a closed loop requires a constraint",
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
    /// Mass properties that no rigid body can have.
    #[error("{what}: {error}\n  help: {help}")]
    Inertia {
        /// The link.
        what: String,
        /// The reasons.
        error: InertiaError,
        /// The remedy.
        help: String,
    },
    /// An include that includes itself.
    #[error("files include each other in a circle: {}\n  help: remove one include", path.join(" -> "))]
    IncludeCycle {
        /// The files.
        path: Vec<String>,
    },
    /// A file that cannot be read.
    #[error("{what} refers to the file `{name}`, which cannot be read: {reason}\n  help: {help}")]
    NoFile {
        /// The element with this reference.
        what: String,
        /// The name.
        name: String,
        /// The reason.
        reason: String,
        /// The remedy.
        help: String,
    },
    /// A feature of the format that this reader does not support.
    #[error("{what}\n  help: {help}")]
    Unsupported {
        /// The fact.
        what: String,
        /// The remedy.
        help: String,
    },
    /// The resulting mechanism is not valid.
    #[error("{0}")]
    Build(MechanismFault),
}

/// One mistake with its position.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{place}: {kind}")]
pub struct FileFault {
    /// The position.
    pub place: FilePlace,
    /// The fault.
    pub kind: FaultKind,
}

/// The reason why a file is rejected: all mistakes in the order of the file.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{}", lines(faults))]
pub struct FormatError {
    /// The mistakes, at least one.
    pub faults: Vec<FileFault>,
}

fn lines(faults: &[FileFault]) -> String {
    faults.iter().map(FileFault::to_string).collect::<Vec<_>>().join("\n")
}
