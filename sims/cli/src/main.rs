//! The command line: linkwork run, check, list, describe, tree, graph, resume, diff.
fn main() {}
