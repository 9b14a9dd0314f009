//! Collision rules: which pairs are checked.

use crate::builder::LwBuilder;
use crate::call::calls;
use crate::edge::{numbers, text};
use crate::status::Fault;
use linkwork_embedded::Neighbours;
use std::ffi::c_char;

/// Bodies that a hinge joins are not checked against each other, except for pairs of `lw_builder_collide`. This is the default.
pub const LW_NEIGHBOURS_PASS: u32 = 0;
/// Bodies that a hinge joins are checked against each other.
pub const LW_NEIGHBOURS_COLLIDE: u32 = 1;

calls![
    /// Excludes a pair from collision checks. Each is the name of a collider, or of a body for all its colliders.
    fn lw_builder_ignore(d: &mut LwBuilder, a: &str, b: &str) {
        d.spec.rules.ignore.push([a, b].map(str::to_owned));
    }

    /// Includes a pair in collision checks although a hinge joins them or they are in the same group of `lw_builder_apart`. `lw_builder_ignore` takes
    /// precedence. Names as there.
    fn lw_builder_collide(d: &mut LwBuilder, a: &str, b: &str) {
        d.spec.rules.collide.push([a, b].map(str::to_owned));
    }

    /// Adds a group of `n` bodies, by name, that are not checked against each other.
    fn lw_builder_apart(d: &mut LwBuilder, bodies: *const *const c_char, n: usize) {
        let mut group = Vec::new();
        for body in numbers("bodies", bodies, n, n)? {
            group.push(text("bodies", *body)?.to_owned());
        }
        d.spec.rules.apart.push(group);
    }

    /// Selects the rule for bodies that a hinge with fewer than six degrees of freedom joins: one of `LW_NEIGHBOURS_...`.
    fn lw_builder_neighbours(d: &mut LwBuilder, neighbours: u32) {
        d.spec.rules.neighbours = match neighbours {
            LW_NEIGHBOURS_PASS => Neighbours::Pass,
            LW_NEIGHBOURS_COLLIDE => Neighbours::Collide,
            value => {
                let help = "one of LW_NEIGHBOURS_..";
                return Err(Fault::Choice { what: "neighbours", value, help });
            }
        };
    }
];
